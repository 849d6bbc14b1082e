// What is drawn: colours of the tile, the plane, curved shapes, and all of it on the screen.

/** Values of RGB as a screen shows them, and back. */
const TRANSFER = `
vec3 encoded(vec3 v) {
  v = clamp(v, 0.0, 1.0);
  return mix(12.92 * v, 1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, greaterThan(v, vec3(0.0031308)));
}
vec3 decoded(vec3 v) {
  return mix(v / 12.92, pow((v + 0.055) / 1.055, vec3(2.4)), greaterThan(v, vec3(0.04045)));
}`;

/** Every texel of a tile in its colour, linear. */
export const COLOR = `${TRANSFER}
uniform usampler2D cluster;
uniform sampler2D palette, normal;
uniform int show;                    // 0 by cluster, 1 by place, 2 by normal
uniform ivec2 size;
out vec4 color;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  if (show == 1) color = vec4(decoded(vec3(vec2(at) / vec2(size), 0.55)), 1);
  else if (show == 2) color = vec4(decoded(texelFetch(normal, at, 0).rgb), 1);
  else {
    int number = int(texelFetch(cluster, at, 0).r);
    color = vec4(texelFetch(palette, ivec2(number & 255, number >> 8), 0).rgb, 1);
  }
}`;

/** Means of four texels a step apart: of squares twice as large, one from each texel on. */
export const AVERAGE = `
uniform sampler2D finer;
uniform ivec2 size;
uniform int step_;
uniform bool wraps;
out vec4 color;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), on = at + step_;
  on = wraps ? on - ivec2(greaterThanEqual(on, size)) * size : min(on, size - 1);
  color = 0.25 * (texelFetch(finer, at, 0) + texelFetch(finer, ivec2(on.x, at.y), 0) + texelFetch(finer, ivec2(at.x, on.y), 0) + texelFetch(finer, on, 0));
}`;

/** Which texel of the tile a place of the surface is; below 0 where there is none. */
const SURFACE = `
uniform isampler2DArray pieces, tables;
uniform int surface;                 // 0 endless, 1 repeated, 2 alone
uniform int level, levels;           // the level whose places are given, and how many there are
uniform ivec2 whole;                 // whole part of the place in the middle of the screen
uniform ivec2 period;                // whole part of it within the tile or the exemplar, below its sides
uniform ivec4 exemplar;              // column, row, width and height in the tile
ivec2 floored(ivec2 p, ivec2 n) {
  p -= n * ivec2(floor(vec2(p) / vec2(n)));
  p += ivec2(lessThan(p, ivec2(0))) * n;
  return p - ivec2(greaterThanEqual(p, n)) * n;
}
ivec2 texelAt(ivec2 step_) {         // so many places from the middle
  if (surface == 2) {
    ivec2 p = (whole + step_) << level;
    bool out_ = any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, exemplar.zw));
    return out_ ? ivec2(-1) : p;
  }
  if (surface == 0) {
    ivec2 place = whole + step_;
    for (int k = level; k < min(level + 3, levels); k++) {
      ivec2 at = place >> (k - level);
      int layer = texelFetch(tables, ivec3((at >> 8) & 31, k), 0).r - 1;
      if (layer < 0) continue;
      ivec2 p = texelFetch(pieces, ivec3(at & 255, layer), 0).rg;
      if (k == level) return p;
      ivec2 on = (place - (at << (k - level))) << level;
      return exemplar.xy + floored(p - exemplar.xy + on, exemplar.zw);
    }
  }
  return exemplar.xy + floored(period + (step_ << level), exemplar.zw);
}`;

/** The plane: its texels' colours have been looked up for the one light and view that all of it has. */
export const FLAT = `${SURFACE}
uniform sampler2D colors;
uniform vec2 fraction, middle, jitter;
uniform mat2 matrix2;                // pixels to places
uniform bool smooth_, picks;
out vec4 color;
vec4 colorAt(ivec2 step_) {
  ivec2 p = texelAt(step_);
  return p.x < 0 ? vec4(0) : texelFetch(colors, p, 0);
}
void main() {
  vec2 at = fraction + matrix2 * (gl_FragCoord.xy - middle + jitter);
  if (picks) { color = vec4(texelAt(ivec2(floor(at))), 0, 1); return; }
  if (!smooth_) { color = colorAt(ivec2(floor(at))); return; }
  vec2 from = floor(at - 0.5), share = at - 0.5 - from;
  ivec2 p = ivec2(from);
  color = mix(mix(colorAt(p), colorAt(p + ivec2(1, 0)), share.x), mix(colorAt(p + ivec2(0, 1)), colorAt(p + 1), share.x), share.y);
}`;

/** Measured directions around another, and how much each counts. */
const LOCATE = `
uniform sampler2D viewCells, lightCells;
uniform usampler2D viewStart, lightStart;
struct Mix { ivec3 numbers; vec3 weights; };
#define LOCATE(NAME, CELLS, START) \\
Mix NAME(vec3 d) { \\
  vec2 disc = d.xy / (1.0 + d.z); \\
  int cell = int(texelFetch(START, ivec2(clamp((disc * 0.5 + 0.5) * 64.0, 0.0, 63.0)), 0).r); \\
  vec3 values; vec4 a, b, c, near; \\
  for (int steps = 0; steps < 24; steps++) { \\
    a = texelFetch(CELLS, ivec2(0, cell), 0); b = texelFetch(CELLS, ivec2(1, cell), 0); \\
    c = texelFetch(CELLS, ivec2(2, cell), 0); near = texelFetch(CELLS, ivec2(3, cell), 0); \\
    values = vec3(dot(a.xyz, d), dot(b.xyz, d), dot(c.xyz, d)); \\
    float least = min(values.x, min(values.y, values.z)); \\
    if (least >= -1e-6 || near.w == 2.0) break; \\
    int next = int(values.x == least ? near.x : values.y == least ? near.y : near.z); \\
    if (next < 0) break; \\
    cell = next; \\
  } \\
  vec3 weights = max(values, 0.0); \\
  if (near.w == 1.0) weights.z = 0.0; \\
  if (near.w == 2.0) weights = vec3(1, 0, 0); \\
  return Mix(ivec3(a.w, b.w, c.w), weights / max(weights.x + weights.y + weights.z, 1e-9)); \\
}
LOCATE(viewMix, viewCells, viewStart)
LOCATE(lightMix, lightCells, lightStart)`;

/** Sphere, rounded box and cylinder, seen from far away. */
export const CURVED = `${SURFACE} ${LOCATE}
uniform sampler2DArray values;       // cluster across, light down, view in depth
uniform usampler2D cluster;
uniform sampler2D colors, lightVectors;
uniform int shape, lights, columns, lightCount;   // 1 sphere, 2 box, 3 cylinder
uniform bool lit, smooth_, picks;
uniform vec2 fraction, middle, jitter;
uniform float radius, texels;        // pixels, and texels, that are the shape's unit of length
uniform mat3 matrix3;                // from the camera to the shape
uniform vec3 light[3];               // in the camera's frame
uniform float intensity[3];
out vec4 color;

const vec3 BOX = vec3(0.62, 0.62, 0.62);
const float ROUND = 0.14;
float distanceTo(vec3 p) {
  if (shape == 2) {
    vec3 q = abs(p) - BOX;
    return length(max(q, 0.0)) + min(max(q.x, max(q.y, q.z)), 0.0) - ROUND;
  }
  vec2 q = vec2(length(p.xz), abs(p.y)) - vec2(0.5, 0.72);
  return length(max(q, 0.0)) + min(max(q.x, q.y), 0.0) - ROUND;
}
vec3 core(vec3 p) {
  if (shape == 2) return clamp(p, -BOX, BOX);
  float r = length(p.xz);
  return vec3(p.xz * min(1.0, 0.5 / max(r, 1e-6)), clamp(p.y, -0.72, 0.72)).xzy;
}
struct Hit { vec3 normal, right, up; vec2 place; };
bool meet(vec2 screen, out Hit hit) {
  vec3 towards = matrix3 * vec3(0, 0, 1), from = matrix3 * vec3(screen, 0.0);
  if (shape == 1) {
    float square = dot(screen, screen);
    if (square >= 1.0) return false;
    vec3 n = from + towards * sqrt(1.0 - square);
    // Of equal areas, without a seam but behind; the frame is that of the front, turned the shortest way.
    hit.place = n.xy * sqrt(2.0 / max(1.0 + n.z, 1e-4));
    float k = 1.0 / max(1.0 + n.z, 1e-4);
    hit.normal = n;
    hit.right = vec3(1.0 - n.x * n.x * k, -n.x * n.y * k, -n.x);
    hit.up = vec3(-n.x * n.y * k, 1.0 - n.y * n.y * k, -n.y);
    return true;
  }
  float t = 2.0, d = 0.0;
  for (int steps = 0; steps < 64; steps++) {
    d = distanceTo(from + towards * t);
    t -= d;
    if (d < 2e-5 || t < -2.0) break;
  }
  if (t < -2.0 || d > 1e-3) return false;
  vec3 p = from + towards * t, c = core(p);
  vec3 n = normalize(p - c);
  hit.normal = n;
  if (abs(n.y) > 0.7071) {
    hit.place = vec2(p.x, -p.z * sign(n.y));
    hit.right = normalize(vec3(1, 0, 0) - n * n.x);
  } else {
    float turn = atan(n.x, n.z), side = n.x < 0.0 ? -1.0 : 1.0, along;
    if (shape == 3) along = turn * 0.64;
    else if (c.z > BOX.z - 1e-4) along = c.x + ROUND * turn;
    else if (c.z < -BOX.z + 1e-4) along = side * (2.0 * BOX.x + 2.0 * BOX.z - side * c.x) + ROUND * turn;
    else along = side * (BOX.x + BOX.z - c.z) + ROUND * turn;
    hit.place = vec2(along, c.y + ROUND * atan(n.y, length(n.xz)));
    hit.right = normalize(vec3(n.z, 0, -n.x));
  }
  hit.up = cross(n, hit.right);
  return true;
}
vec3 valueOf(int number, Mix v, Mix l) {
  vec3 sum = vec3(0);
  int x = number % columns, y = number / columns * lightCount;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      sum += v.weights[i] * l.weights[j] * texelFetch(values, ivec3(x, y + l.numbers[j], v.numbers[i]), 0).rgb;
  return sum;
}
Mix seen, from_[3];
float scale[3];
vec4 colorAt(ivec2 step_) {
  ivec2 p = texelAt(step_);
  if (p.x < 0) return vec4(0.02, 0.02, 0.02, 1);
  if (!lit) return texelFetch(colors, p, 0);
  int number = int(texelFetch(cluster, p, 0).r);
  vec3 sum = vec3(0);
  for (int n = 0; n < lights; n++) if (scale[n] > 0.0) sum += scale[n] * valueOf(number, seen, from_[n]);
  return vec4(sum, 1);
}
void main() {
  Hit hit;
  color = vec4(0);
  if (!meet((gl_FragCoord.xy - middle + jitter) / radius, hit)) return;
  // Rows of the tile run downwards.
  vec2 at = fraction + vec2(hit.place.x, -hit.place.y) * texels;
  if (picks) {
    color = vec4(texelAt(ivec2(floor(at))), 0, 1);
    return;
  }
  mat3 local = transpose(mat3(hit.right, hit.up, hit.normal));
  if (lit) {
    seen = viewMix(local * (matrix3 * vec3(0, 0, 1)));
    for (int n = 0; n < lights; n++) {
      vec3 d = local * (matrix3 * light[n]);
      scale[n] = 0.0;
      if (d.z <= 0.0) continue;
      from_[n] = lightMix(d);
      // Beyond the outermost lights the values are theirs, scaled by the cosine.
      vec3 mean = vec3(0);
      for (int j = 0; j < 3; j++) mean += from_[n].weights[j] * texelFetch(lightVectors, ivec2(from_[n].numbers[j], 0), 0).xyz;
      float cosine = mean.z / max(length(mean), 1e-6);
      scale[n] = intensity[n] * (d.z < cosine - 1e-5 ? clamp(d.z / cosine, 0.0, 1.0) : 1.0);
    }
  }
  if (!smooth_) { color = colorAt(ivec2(floor(at))); return; }
  vec2 first = floor(at - 0.5), share = at - 0.5 - first;
  ivec2 p = ivec2(first);
  color = mix(mix(colorAt(p), colorAt(p + ivec2(1, 0)), share.x), mix(colorAt(p + ivec2(0, 1)), colorAt(p + 1), share.x), share.y);
}`;

/** The mean of the samples, on the screen. */
export const PRESENT = `${TRANSFER}
uniform sampler2D mean;
uniform float exposure;
uniform vec2 scale;
out vec4 color;
void main() {
  vec4 v = texelFetch(mean, ivec2(gl_FragCoord.xy * scale), 0);
  if (v.a > 0.0) v.rgb /= v.a;
  color = vec4(encoded(v.rgb * exposure) * v.a, v.a);
}`;
