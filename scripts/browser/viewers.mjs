// Opens an exported pyramid in OpenSeadragon and in our own page, and holds screenshots against pictures by `btf image`.
// Usage: node viewers.mjs MODULES WORK; WORK holds what scripts/test-browser made, screenshots go there too.
import { createServer } from "node:http";
import { createReadStream, promises as files } from "node:fs";
import { createRequire } from "node:module";
import { extname, join, normalize } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, work] = process.argv.slice(2);
const require = createRequire(join(modules, "node_modules", "x.js"));
const { chromium } = require("playwright-core");
const { PNG } = require("pngjs");

const WIDTH = 500, HEIGHT = 400;
// Window of the reference pictures: it crosses borders of tiles both ways. The second is the first one dragged.
const PLACE = { x: 410, y: 330 }, DRAG = { x: 90, y: 55 };

const types = { ".html": "text/html", ".js": "text/javascript", ".png": "image/png", ".jpg": "image/jpeg", ".dzi": "application/xml" };
const page_of = name => `<!DOCTYPE html><style>html,body,#v{margin:0;width:100%;height:100%;background:#fff}</style><div id="v"></div>
<script src="/openseadragon.min.js"></script><script>
const viewer = OpenSeadragon({ id: "v", tileSources: "/${name}.dzi", drawer: "canvas", showNavigationControl: false, immediateRender: true, animationTime: 0 });
window.failed = [];
viewer.addHandler("open-failed", event => failed.push(event.message));
viewer.addHandler("tile-load-failed", event => failed.push(event.message));
viewer.addHandler("open", () => {
  const view = viewer.viewport;
  view.zoomTo(view.imageToViewportZoom(1), null, true);
  view.panTo(view.imageToViewportCoordinates(${PLACE.x + WIDTH / 2}, ${PLACE.y + HEIGHT / 2}), true);
  window.opened = true;
});
</script>`;

const server = createServer(async (request, response) => {
  const path = normalize(decodeURIComponent(new URL(request.url, "http://localhost").pathname));
  const viewer = /^\/osd-(\w+)$/.exec(path);
  const file = path === "/openseadragon.min.js" ? join(modules, "node_modules/openseadragon/build/openseadragon", path) : join(work, path);
  if (viewer) return response.writeHead(200, { "content-type": "text/html" }).end(page_of(viewer[1]));
  if (path === "/favicon.ico") return response.writeHead(204).end();
  if (!(await files.stat(file).catch(() => null))?.isFile()) return response.writeHead(404).end();
  response.writeHead(200, { "content-type": types[extname(file)] ?? "application/octet-stream" });
  createReadStream(file).pipe(response);
});
await new Promise(listening => server.listen(0, "127.0.0.1", listening));
const site = `http://127.0.0.1:${server.address().port}`;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--force-color-profile=srgb", "--hide-scrollbars"],
});

function expect(holds, what) {
  if (!holds) throw new Error(what);
}

// A page that notes every request that goes wrong, or leaves this machine.
async function open(address) {
  const page = await browser.newPage({ viewport: { width: WIDTH, height: HEIGHT }, deviceScaleFactor: 1 });
  const wrong = [];
  page.on("response", response => response.status() >= 400 && wrong.push(`${response.status()} ${response.url()}`));
  page.on("requestfailed", request => wrong.push(`${request.failure()?.errorText} ${request.url()}`));
  page.on("pageerror", error => wrong.push(String(error)));
  page.on("request", request => /^(data|blob|file):/.test(request.url()) || request.url().startsWith(site) || wrong.push(`asked for ${request.url()}`));
  await page.goto(address);
  return { page, wrong };
}

async function shot(page, name) {
  const bytes = await page.screenshot({ path: join(work, `${name}.png`) });
  return PNG.sync.read(bytes);
}

const reference = async name => PNG.sync.read(await files.readFile(join(work, `${name}.png`)));

// Largest and mean difference of the colours of two pictures of one size, and the spread of the first.
function compare(found, expected) {
  expect(found.width === expected.width && found.height === expected.height, `got ${found.width}x${found.height}`);
  let most = 0, sum = 0, darkest = 255, lightest = 0;
  for (let at = 0; at < found.data.length; at++) {
    if (at % 4 === 3) continue;
    const difference = Math.abs(found.data[at] - expected.data[at]);
    most = Math.max(most, difference);
    sum += difference;
    darkest = Math.min(darkest, found.data[at]);
    lightest = Math.max(lightest, found.data[at]);
  }
  return { most, mean: sum / (3 * found.width * found.height), spread: lightest - darkest };
}

async function same(name, found, expected, most, mean) {
  const result = compare(found, await reference(expected));
  console.log(`${name}: largest difference ${result.most}, mean ${result.mean.toFixed(3)}`);
  expect(result.spread > 30, `${name} is blank`);
  expect(result.most <= most && result.mean <= mean, `${name} differs from ${expected}: ${JSON.stringify(result)}`);
}

async function in_openseadragon(pyramid, most, mean) {
  const { page, wrong } = await open(`${site}/osd-${pyramid}`);
  await page.waitForFunction(() => failed.length || (window.opened && viewer.world.getItemAt(0)?.getFullyLoaded()), null, { timeout: 30000 });
  await page.evaluate(() => new Promise(done => { viewer.forceRedraw(); requestAnimationFrame(() => requestAnimationFrame(done)); }));
  const failed = await page.evaluate(() => window.failed);
  expect(!failed.length && !wrong.length, `OpenSeadragon: ${[...failed, ...wrong].join("; ")}`);
  await same(`${pyramid} in OpenSeadragon`, await shot(page, `osd-${pyramid}`), "there", most, mean);
  await page.close();
}

const settled = (page, state) => page.waitForFunction(state => document.body.dataset.state === state, state, { timeout: 30000 });

async function in_our_page(name, base) {
  const { page, wrong } = await open(`${base}#${PLACE.x + WIDTH / 2},${PLACE.y + HEIGHT / 2},1`);
  await page.addStyleTag({ content: "#bar { visibility: hidden }" });
  await settled(page, "ready");
  await same(`${name}, 1:1`, await shot(page, `${name}-there`), "there", 0, 0);
  await page.mouse.move(300, 300);
  await page.mouse.down();
  await page.mouse.move(250, 260, { steps: 3 });
  await page.mouse.move(300 - DRAG.x, 300 - DRAG.y);
  await page.mouse.up();
  await settled(page, "ready");
  await same(`${name}, dragged`, await shot(page, `${name}-dragged`), "dragged", 0, 0);
  // In by the wheel and out again about the same point, then in and out by keys: the same place.
  for (const by of [-240, 240]) {
    await page.mouse.wheel(0, by);
    await page.waitForFunction(by => told.textContent.endsWith(by < 0 ? "200 %" : "100 %"), by);
  }
  await page.keyboard.press("+");
  await page.keyboard.press("-");
  await settled(page, "ready");
  await same(`${name}, zoomed in and out`, await shot(page, `${name}-back`), "dragged", 0, 0);
  await page.keyboard.press("0");
  await page.waitForFunction(() => !told.textContent.endsWith(" 100 %"));
  await settled(page, "ready");
  // The whole picture, averaged by tiles and browser: near the picture as the level below shows it.
  const fitted = await shot(page, `${name}-fit`);
  const whole = await reference("whole");
  const mean = picture => {
    let sum = 0, count = 0;
    const x0 = Math.ceil((picture.width - picture.height * whole.width / whole.height) / 2) + 2;
    for (let y = 2; y < picture.height - 2; y++) for (let x = Math.max(0, x0); x < picture.width - Math.max(0, x0); x++) { sum += picture.data[4 * (y * picture.width + x) + 1]; count++; }
    return sum / count;
  };
  const [shown, expected] = [mean(fitted), mean(whole)];
  console.log(`${name}, whole: mean green ${shown.toFixed(1)}, of the picture ${expected.toFixed(1)}`);
  expect(Math.abs(shown - expected) < 6, `${name}: the whole picture has another brightness`);
  await page.evaluate(() => document.querySelector("#bar").style.visibility = "visible");
  await shot(page, `${name}-bar`);
  expect(!wrong.length, `${name}: ${wrong.join("; ")}`);
  await page.close();
}

async function missing_tile() {
  const tile = join(work, "png_files/11/2_2.png");
  await files.rename(tile, `${tile}.away`);
  const { page, wrong } = await open(`${site}/png.html#${PLACE.x + WIDTH / 2},${PLACE.y + HEIGHT / 2},1`);
  await settled(page, "failed");
  expect(wrong.some(text => text.startsWith("404")), "a missing tile goes unnoticed");
  expect((await page.textContent("#note")).includes("1 tile is missing"), "the page does not tell that a tile is missing");
  await shot(page, "missing");
  await page.close();
  await files.rename(`${tile}.away`, tile);
}

try {
  await in_openseadragon("png", 1, 0.01);
  await in_openseadragon("jpeg", 40, 4);
  await in_our_page("served", `${site}/png.html`);
  await in_our_page("file", pathToFileURL(join(work, "png.html")).href);
  await missing_tile();
} catch (error) {
  console.error(`test-browser: ${error.message}`);
  process.exitCode = 1;
} finally {
  await browser.close();
  server.close();
}
