// Opens the pages of `btf view` in Chromium, as files and from the server, and holds what they draw against the program.
// Usage: node view.mjs MODULES WORK BTF; WORK holds what scripts/test-browser made, screenshots go there too.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { promises as files } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, work, btf] = process.argv.slice(2);
const require = createRequire(join(modules, "node_modules", "x.js"));
const { chromium } = require("playwright-core");
const { PNG } = require("pngjs");
const web = name => import(pathToFileURL(join(modules, "web", name)).href);
const { Interpolator, vectorOf } = await web("directions.js");
const { LINEAR, srgbCode } = await web("palette.js");

const WIDTH = 400, HEIGHT = 300;
const PATIENCE = 120000;
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--force-color-profile=srgb", "--hide-scrollbars"],
});

// A page that notes what it must not do: ask for anything but itself, or complain.
async function open(address, { width = WIDTH, height = HEIGHT, dark = false, before } = {}) {
  const page = await browser.newPage({ viewport: { width, height }, colorScheme: dark ? "dark" : "light", acceptDownloads: true });
  const wrong = [], asked = [];
  page.on("request", request => /^(data|blob):/.test(request.url()) || asked.push(request.url()));
  page.on("pageerror", error => wrong.push(String(error)));
  page.on("console", message => message.type() === "error" && wrong.push(message.text()));
  if (before) await page.addInitScript(before);
  await page.goto(address);
  return { page, wrong, asked };
}

const settled = (page, state = "ready") => page.waitForFunction(state => document.body.dataset.state === state, state, { timeout: PATIENCE });

// What tests need in the page.
const tools = () => {
  const base64 = array => {
    const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
    let text = "";
    for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
    return btoa(text);
  };
  const { viewer } = window, { renderer } = viewer, { gl } = renderer;
  window.tools = {
    base64,
    // The first sample of a state: that of the pixels' middles.
    picture(state) {
      const whole = viewer.allowed({ ...viewer.first, ...state });
      while (renderer.work(whole, false));
      renderer.samples = 0;
      renderer.sample(whole, 1, false);
      const pixels = renderer.pixels(whole);
      renderer.seen = "";
      return base64(pixels);
    },
    // Linear colours of the tile's texels.
    tile(state) {
      const whole = { ...viewer.first, surface: "tile", ...state }, { width, height } = renderer.tile;
      renderer.color(renderer.tile, whole, 0);
      const frame = gl.createFramebuffer(), pixels = new Float32Array(4 * width * height);
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, renderer.tile.colors[0], 0);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, pixels);
      return base64(pixels);
    },
    // Positions of a window by the GPU.
    positions(synthesis, seed, window, level) {
      synthesis.window(seed, window, level, () => renderer.tiles.bind(143));
      const values = new Int32Array(4 * window.width * window.height);
      gl.readPixels(0, 0, window.width, window.height, gl.RGBA_INTEGER, gl.INT, values);
      return Int32Array.from({ length: window.width * window.height }, (_, n) => values[4 * n + 1] << 16 | values[4 * n]);
    },
  };
};

const decoded = text => new Uint8Array(Buffer.from(text, "base64"));
const reference = async name => PNG.sync.read(await files.readFile(join(work, name)));

// Largest difference of red, green and blue.
function largest(found, expected) {
  assert.equal(found.length, expected.length);
  let most = 0;
  for (let at = 0; at < found.length; at++) if (at % 4 !== 3) most = Math.max(most, Math.abs(found[at] - expected[at]));
  return most;
}

function within(name, most, limit) {
  console.log(`${name}: largest difference ${most}`);
  assert.ok(most <= limit, `${name}: got a difference of ${most} levels, expected at most ${limit}`);
}

// Pictures of the page against those of `btf image`; the names of the references say what they show.
async function against_the_program(page) {
  for (const name of (await files.readdir(work)).filter(name => /^(tile|plane)_.*\.png$/.test(name)).sort()) {
    const [kind, theta, phi, view, turn, x, y, seed] = name.replace(".png", "").split("_");
    const state = { light: [Number(theta), Number(phi)], view: [Number(view), Number(turn)] };
    const expected = await reference(name);
    if (kind === "tile") {
      const linear = new Float32Array(decoded(await page.evaluate(state => tools.tile(state), state)).buffer);
      within(name, largest(Array.from(linear, (value, at) => at % 4 === 3 ? 255 : srgbCode(value)), expected.data), 1);
    } else {
      const at = [Number(x) + WIDTH / 2, Number(y) + HEIGHT / 2];
      const found = decoded(await page.evaluate(state => tools.picture(state), { ...state, surface: "endless", at, seed: Number(seed), zoom: 1 }));
      within(name, largest(found, expected.data), 2);
    }
  }
}

// The sphere against an evaluation in double precision, written here.
async function sphere(page) {
  const material = await page.evaluate(() => {
    const { material, clusters, tile } = viewer.renderer, names = ["views", "view_triangles", "lights", "light_triangles", "index", "representatives"];
    return { arrays: Object.fromEntries(names.map(name => [name, tools.base64(material.array(name))])), views: clusters.views, lights: clusters.lights, width: tile.width, height: tile.height };
  });
  const bytes = name => decoded(material.arrays[name]), { width, height } = material;
  const directions = name => new Interpolator(new Float64Array(bytes(`${name}s`).buffer), new Uint16Array(bytes(`${name}_triangles`).buffer));
  const views = directions("view"), lights = directions("light"), index = bytes("index"), samples = bytes("representatives");
  const dot = (a, b) => a.reduce((sum, value, axis) => sum + value * b[axis], 0);
  const wrap = (place, side) => ((place % side) + side) % side;
  for (const [light, view] of [[[35, 120], [0, 0]], [[70, 300], [25, 200]], [[10, 40], [60, 75]], [[88, 180], [0, 0]]]) {
    const state = { shape: "sphere", surface: "repeated", light, view, zoom: 1.2, scale: 100, at: [31, 17] };
    const found = decoded(await page.evaluate(state => tools.picture(state), state));
    const towards = vectorOf(...view), across = Math.hypot(towards[0], towards[2]), [x, y, z] = towards;
    const right = [z / across, 0, -x / across], up = [y * right[2], z * right[0] - x * right[2], -y * right[0]];
    const turn = [right, up, towards], lightThere = [0, 1, 2].map(axis => dot(vectorOf(...light), turn.map(row => row[axis])));
    const radius = 120;
    let most = 0, lit = 0;
    for (let row = 3; row < HEIGHT; row += 7)
      for (let column = 2; column < WIDTH; column += 7) {
        const sx = (column + 0.5 - WIDTH / 2) / radius, sy = (HEIGHT / 2 - row - 0.5) / radius, square = sx * sx + sy * sy;
        if (square > 0.98) continue;
        const n = [0, 1, 2].map(axis => sx * turn[0][axis] + sy * turn[1][axis] + Math.sqrt(1 - square) * towards[axis]);
        // The frame of the front, turned to the normal the shortest way.
        const k = 1 / (1 + n[2]);
        const frame = [[1 - n[0] * n[0] * k, -n[0] * n[1] * k, -n[0]], [-n[0] * n[1] * k, 1 - n[1] * n[1] * k, -n[1]]];
        const local = d => [dot(frame[0], d), dot(frame[1], d), dot(n, d)], stretch = Math.sqrt(2 * k);
        const u = 31 + n[0] * stretch * 100 - 0.5, v = 17 - n[1] * stretch * 100 - 0.5, from = local(lightThere), sum = [0, 0, 0];
        if (from[2] > 0) {
          const v_mix = views.mix(local(towards)), l_mix = lights.mix(from);
          for (let corner = 0; corner < 4; corner++) {
            const [dx, dy] = [corner & 1, corner >> 1], x = Math.floor(u), y = Math.floor(v);
            const share = (dx ? u - x : 1 - u + x) * (dy ? v - y : 1 - v + y);
            const cluster = index[wrap(y + dy, height) * width + wrap(x + dx, width)];
            for (const [a, wa] of v_mix.terms) for (const [b, wb] of l_mix.terms)
              for (let c = 0; c < 3; c++)
                sum[c] += share * wa * wb * l_mix.cosineRatio * LINEAR[samples[3 * ((cluster * material.views + a) * material.lights + b) + c]];
          }
          lit++;
        }
        for (let c = 0; c < 3; c++) most = Math.max(most, Math.abs(srgbCode(sum[c]) - found[4 * (row * WIDTH + column) + c]));
      }
    assert.ok(lit > 300, `only ${lit} pixels are lit`);
    within(`sphere, light ${light}, view ${view}`, most, 2);
  }
}

// Pieces of the endless plane by shaders against plain JavaScript, and both against the example of the specification.
async function plane(page) {
  const example = JSON.parse(await files.readFile("docs/method/coherent-example.json", "utf8"));
  const differing = await page.evaluate(example => {
    const { renderer } = viewer, { tiles, plane } = renderer, Plane = plane.constructor, Synthesis = tiles.synthesis.constructor;
    const count = (a, b) => a.reduce((sum, value, n) => sum + Number(value !== b[n]), 0), told = {};
    for (const [level, row, column, seed] of [[0, 0, 0, 1], [0, -3, -2, 1], [0, 4000000, -4000000, 4294967295], [1, 5, -7, 9], [2, -1, 0, 2]]) {
      const window = { y: row * 256, x: column * 256, height: 256, width: 256 };
      told[`level ${level}, row ${row}, column ${column}, seed ${seed}`] =
        count(tools.positions(tiles.synthesis, seed, window, level), plane.window(seed, window, level));
    }
    // Pieces join: one across a seam holds the same.
    const across = plane.window(1, { y: -20, x: -30, height: 40, width: 60 }), whole = plane.window(1, { y: -256, x: -256, height: 512, width: 512 });
    told["across a seam"] = count(across, Int32Array.from({ length: 2400 }, (_, n) => whole[(236 + Math.floor(n / 60)) * 512 + 226 + n % 60]));
    const height = example.index.length, width = example.index[0].length;
    example.windows.forEach((wanted, number) => {
      if (wanted.joins) return;
      const arrays = { index: example.index.flat(), features: example.features.flat() };
      example.levels.forEach(({ basis, offset }, level) => Object.assign(arrays, { [`basis_${level}`]: basis.flat(), [`offset_${level}`]: offset }));
      const levels = example.levels.map(level => ({ ...level, dims: level.offset.length }));
      const { wraps, lattice, jitter } = wanted;
      const made = new Plane({ header: { tile: { width, height, wraps }, appearance: { exemplar: [0, 0, height, width], wraps, lattice, jitter, levels } }, array: name => arrays[name] });
      while (!made.isReady) made.makeLevel();
      const window = { y: wanted.y, x: wanted.x, height: wanted.positions.length, width: wanted.positions[0].length };
      const expected = wanted.positions.flat().map(position => Math.floor(position / width) << 16 | position % width);
      told[`example ${number}, plain`] = count(expected, made.window(wanted.seed, window, 0));
      told[`example ${number}, shaders`] = count(expected, tools.positions(new Synthesis(renderer.gl, made), wanted.seed, window, 0));
      if (number === 0) told.another = count(expected, made.window(wanted.seed + 1, window, 0));
    });
    return told;
  }, example);
  const { another, ...same } = differing;
  console.log("texels that differ:", JSON.stringify(same));
  assert.ok(Object.keys(same).length >= 11, "too few windows were looked at");
  for (const [name, count] of Object.entries(same)) assert.equal(count, 0, `${name}: texels differ`);
  assert.ok(another > 100, "another seed gives the same");
}

// Zoomed out, the surface keeps its brightness: what is shown are means of texels, not single ones.
async function zoomed_out(page) {
  const mean = pixels => pixels.reduce((sum, value, at) => at % 4 === 1 ? sum + LINEAR[value] : sum, 0) / (pixels.length / 4);
  const spread = (pixels, m) => Math.sqrt(pixels.reduce((sum, value, at) => at % 4 === 1 ? sum + (LINEAR[value] - m) ** 2 : sum, 0) / (pixels.length / 4));
  const state = { light: [50, 60], at: [100, 100], surface: "endless" };
  const near = decoded(await page.evaluate(state => tools.picture(state), { ...state, zoom: 1 }));
  const far = decoded(await page.evaluate(state => tools.picture(state), { ...state, zoom: 0.25 }));
  // The mean of 4 x 4 pixels of the near picture is what a pixel of the far one should vary like.
  const means = [];
  for (let y = 0; y < HEIGHT; y += 4) for (let x = 0; x < WIDTH; x += 4) {
    let sum = 0;
    for (let n = 0; n < 16; n++) sum += LINEAR[near[4 * ((y + (n >> 2)) * WIDTH + x + (n & 3)) + 1]];
    means.push(0, srgbCode(sum / 16), 0, 255);
  }
  const [a, b] = [mean(near), mean(far)], [c, d] = [spread(means, mean(means)), spread(far, b)];
  console.log(`zoomed out: mean ${b.toFixed(4)} of ${a.toFixed(4)}, spread ${d.toFixed(4)} of ${c.toFixed(4)}`);
  assert.ok(Math.abs(b / a - 1) < 0.04, "zooming out changes the brightness");
  assert.ok(Math.abs(d / c - 1) < 0.25, "zooming out shimmers, or is grey");
}

const state_of = page => page.evaluate(() => structuredClone(viewer.state));

// Mouse, wheel, keys and controls.
async function controls(page) {
  await page.evaluate(() => { viewer.act("reset"); viewer.choose("surface", "repeated"); });
  const first = await state_of(page);
  const drag = async (dx, dy) => {
    await page.mouse.move(150, 200);
    await page.mouse.down();
    await page.mouse.move(150 + dx, 200 + dy, { steps: 3 });
    await page.mouse.up();
  };
  await drag(60, 0);
  const lit = await state_of(page);
  assert.notDeepEqual(lit.light, first.light, "a drag does not move the light");
  assert.deepEqual(lit.view, first.view);
  await page.keyboard.down("Shift");
  await drag(0, 50);
  await page.keyboard.up("Shift");
  const turned = await state_of(page);
  assert.ok(turned.view[0] > 10 && String(turned.light) === String(lit.light), "a drag with Shift does not turn");
  await page.keyboard.press("0");
  assert.deepEqual((await state_of(page)).view, [0, 0]);
  await page.keyboard.down("Control");
  await drag(40, -20);
  await page.keyboard.up("Control");
  const moved = await state_of(page);
  assert.ok(Math.abs(moved.at[0] - (first.at[0] - 40 / first.zoom)) < 1e-6 && Math.abs(moved.at[1] - (first.at[1] + 20 / first.zoom)) < 1e-6, `moved to ${moved.at}`);
  // Zooming keeps the texel under the pointer.
  await page.mouse.move(100, 250);
  const under = ({ at, zoom }) => [at[0] + (100 - WIDTH / 2) / zoom, at[1] + (250 - HEIGHT / 2) / zoom];
  await page.mouse.wheel(0, -200);
  await page.waitForFunction(zoom => viewer.state.zoom > zoom, moved.zoom);
  const zoomed = await state_of(page);
  under(zoomed).forEach((place, axis) => assert.ok(Math.abs(place - under(moved)[axis]) < 1e-6, "zooming slides"));
  await page.keyboard.press("ArrowRight");
  assert.notDeepEqual((await state_of(page)).light, zoomed.light, "arrows do not move the light");
  await page.focus("#dome");
  const text = await page.getAttribute("#dome", "aria-valuetext");
  for (let n = 0; n < 4; n++) await page.keyboard.press("ArrowDown");
  assert.notEqual(await page.getAttribute("#dome", "aria-valuetext"), text, "arrows on the disc do not move the light");
  await page.focus("#picture");
  await page.keyboard.press("2");
  assert.equal((await state_of(page)).shape, "sphere");
  assert.ok(await page.isChecked("input[name=shape][value=sphere]"));
  await page.keyboard.press("1");
  // The address brings the state back.
  const address = await page.evaluate(() => location.hash), before = await state_of(page);
  await page.evaluate(() => viewer.act("reset"));
  await page.evaluate(hash => { location.hash = hash; }, address);
  await page.waitForFunction(light => Math.abs(viewer.state.light[1] - light) < 0.01, before.light[1]);
  const [download] = await Promise.all([page.waitForEvent("download"), page.evaluate(() => viewer.act("save"))]);
  assert.match(download.suggestedFilename(), /\.png$/);
  await page.mouse.move(120, 180);
  await page.waitForFunction(() => !document.querySelector("#inspector").hidden, null, { timeout: PATIENCE });
  assert.match(await page.textContent("[data-told]"), /^Cluster \d+ of \d+/);
}

// What is on the page at a size, as a picture to look at.
async function shots() {
  const of = (name, hash, options) => ({ name, hash, ...options });
  for (const { name, hash, ...options } of [
    of("view-wide", "shape=plane&zoom=3", { width: 1400, height: 900 }),
    of("view-narrow-dark", "shape=sphere&surface=repeated&zoom=0.8", { width: 400, height: 800, dark: true }),
  ]) {
    const { page, wrong, asked } = await open(`${pathToFileURL(join(work, "view.html")).href}#${hash}`, options);
    await settled(page);
    if (options.width === 400) {
      await page.click("#toggle");
      await page.waitForTimeout(400);
      await settled(page);
    }
    const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.equal(overflow, 0, `${name} is wider than its window`);
    await page.screenshot({ path: join(work, `${name}.png`) });
    assert.deepEqual([wrong, asked.length], [[], 1], `${name}: ${wrong} ${asked}`);
    await page.close();
  }
}

// While the tile stands in for the endless surface, the page says that it computes; title and controls never overlap.
async function first_moments() {
  for (const [width, height] of [[700, 450], [1000, 700], [400, 600]]) {
    const { page, wrong } = await open(`${pathToFileURL(join(work, "view.html")).href}#surface=endless`, {
      width, height,
      before: () => {
        window.told = [];
        new MutationObserver(() => {
          const notice = document.getElementById("notice");
          if (notice && !notice.hidden) window.told.push(`${document.body.classList.contains("bare")} ${notice.textContent}`);
        }).observe(document, { subtree: true, childList: true, attributes: true });
      },
    });
    await settled(page);
    assert.ok((await page.evaluate(() => window.told)).some(told => /^true Computing the surface/.test(told)), "nothing was said");
    assert.ok(await page.evaluate(() => document.getElementById("notice").hidden && !document.body.classList.contains("bare")));
    const [title, panel] = await page.evaluate(() => ["header", "#panel"].map(name => document.querySelector(name).getBoundingClientRect().toJSON()));
    const is_seen = await page.evaluate(() => getComputedStyle(document.querySelector("#panel")).visibility === "visible");
    assert.ok(!is_seen || title.right <= panel.left || title.bottom <= panel.top, `${width}x${height}: the controls overlap the title`);
    assert.match(await page.textContent("[data-light]"), /theta \d+°, phi \d+°/);
    assert.deepEqual(wrong, []);
    await page.close();
  }
}

// Without WebGL 2 the page says so.
async function without_webgl() {
  const { page } = await open(pathToFileURL(join(work, "view.html")).href, {
    before: () => { HTMLCanvasElement.prototype.getContext = () => null; },
  });
  await settled(page, "failed");
  assert.match(await page.textContent("#notice"), /no WebGL 2/);
  await page.close();
}

// The page from the server is the same.
async function served() {
  const server = spawn(btf, ["view", join(work, "m.model.zarr")], { stdio: ["ignore", "pipe", "inherit"] });
  try {
    const address = await new Promise((found, failed) => {
      let text = "";
      server.on("exit", () => failed(new Error("btf view ended")));
      server.stdout.on("data", data => {
        text += data;
        const line = /http:\S+/.exec(text);
        if (line) found(line[0]);
      });
    });
    const { page, wrong, asked } = await open(`${address}#surface=tile&zoom=1`);
    await settled(page);
    assert.ok(asked.every(request => request.startsWith(address.split("#")[0])), `asked for ${asked}`);
    assert.equal(asked.length, 2, `asked for ${asked}`);
    assert.deepEqual(wrong, []);
    await page.close();
  } finally {
    server.kill("SIGINT");
  }
}

try {
  const { page, wrong, asked } = await open(`${pathToFileURL(join(work, "view.html")).href}#surface=endless`);
  await settled(page);
  await page.evaluate(tools);
  await against_the_program(page);
  await sphere(page);
  await plane(page);
  await zoomed_out(page);
  await controls(page);
  assert.deepEqual(wrong, []);
  assert.equal(asked.length, 1, `the page asked for ${asked}`);
  await page.close();
  const enlarged = await open(`${pathToFileURL(join(work, "view-big.html")).href}#zoom=1&light=30,90&at=${410 + WIDTH / 2},${330 + HEIGHT / 2}`);
  await settled(enlarged.page);
  await enlarged.page.evaluate(tools);
  const found = decoded(await enlarged.page.evaluate(() => tools.picture(structuredClone(viewer.state))));
  within("enlargement", largest(found, (await reference("part.png")).data), 2);
  assert.deepEqual(enlarged.wrong, []);
  await enlarged.page.close();
  await shots();
  await first_moments();
  await without_webgl();
  await served();
} catch (error) {
  console.error(`test-browser: ${error.stack}`);
  process.exitCode = 1;
} finally {
  await browser.close();
}
