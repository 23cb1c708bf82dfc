// Loads the `three` profile's output in three.js, in headless Chromium, by the snippet that `steradian prefilter`
// prints, renders white metal spheres of several roughnesses and compares them with our own values.
//
//   apt-get install chromium          (or any Chrome; CHROMIUM names it)
//   npm install three@0.187.0 playwright-core
//   node scripts/interop-three.mjs STERADIAN ENVIRONMENT
//
// STERADIAN is the built command, ENVIRONMENT an image or a sky spec. Neither building nor testing needs this script.
//
// For F0 = 1, three.js shades E(n·v, r) · L(d, lod) + (1 − E) · L(n, last level), d = normalize(mix(reflect, n, r⁴)).
// E and lod are measured at each pixel by two other maps through the same shader: one that holds 1 on every level but
// the last, one that holds m/L on level m. L comes from `steradian sample`, which undoes the profile.

import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { createServer } from 'node:http';
import { dirname, join } from 'node:path';
import { tmpdir } from 'node:os';

const require = createRequire(join(process.cwd(), 'package.json'));
const { chromium } = require('playwright-core');
const three = dirname(dirname(require.resolve('three')));
const [steradian, environment] = process.argv.slice(2);
if (!environment) throw new Error('usage: node interop-three.mjs STERADIAN ENVIRONMENT');

const dir = mkdtempSync(join(tmpdir(), 'interop-three-'));
const run = (...a) => execFileSync(steradian, a, { maxBuffer: 1 << 28 }).toString();
const report = JSON.parse(run('prefilter', environment, '--profile', 'three', '--name', 'env', '-o', join(dir, 'out'), '--json', '-q'));
const file = join(dir, 'out', 'env_pmrem.ktx2');
const last = report.levels.length - 1;
const roughnesses = [0.1, 0.2, 0.35, 0.5, 0.7, 0.9];

const page = `<!doctype html><script type="importmap">{"imports":{"three":"/three/build/three.module.js","three/addons/":"/three/examples/jsm/"}}</script>
<script type="module">
import * as THREE from 'three';
const scene = new THREE.Scene();
${report.snippet}
const S = 512;
const material = new THREE.MeshStandardMaterial({ color: 0xffffff, metalness: 1 });
scene.add(new THREE.Mesh(new THREE.SphereGeometry(1, 512, 256), material));
const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
camera.position.z = 5;
const renderer = new THREE.WebGLRenderer();
renderer.toneMapping = THREE.NoToneMapping;
const target = new THREE.WebGLRenderTarget(S, S, { type: THREE.FloatType, colorSpace: THREE.LinearSRGBColorSpace });
const half = THREE.DataUtils.toHalfFloat;
const coded = value => {
  const faces = [0, 1, 2, 3, 4, 5].map(() => ({ width: ktx.pixelWidth, height: ktx.pixelWidth,
    mipmaps: ktx.levels.map((l, m) => { const n = ktx.pixelWidth >> m; const v = half(value(m, ktx.levels.length - 1));
      return { data: new Uint16Array(4 * n * n).fill(v), width: n, height: n }; }) }));
  const t = new THREE.CompressedCubeTexture(faces, THREE.RGBAFormat, THREE.HalfFloatType);
  return Object.assign(t, { isPMREMTexture: true, mapping: THREE.CubeReflectionMapping, generateMipmaps: false,
    minFilter: THREE.LinearMipmapLinearFilter, magFilter: THREE.LinearFilter, colorSpace: THREE.LinearSRGBColorSpace, needsUpdate: true });
};
const maps = [scene.environment, coded((m, L) => m < L ? 1 : 0), coded((m, L) => m / L)];
const pixels = [];
for (let j = 12; j < S; j += 37) for (let i = 12; i < S; i += 37) {
  const x = (i + 0.5) / S * 2 - 1, y = (j + 0.5) / S * 2 - 1;
  if (x * x + y * y < 0.8) pixels.push([i, j, x, y, Math.sqrt(1 - x * x - y * y)]);
}
window.result = ${JSON.stringify(roughnesses)}.map(r => {
  material.roughness = r;
  const read = maps.map(map => {
    scene.environment = map;
    renderer.setRenderTarget(target);
    renderer.clear();
    renderer.render(scene, camera);
    const data = new Float32Array(4 * S * S);
    renderer.readRenderTargetPixels(target, 0, 0, S, S, data);
    return data;
  });
  return { r, pixels: pixels.map(([i, j, ...n]) => ({ n, values: read.map(d => [...d.slice(4 * (j * S + i), 4 * (j * S + i) + 3)]) })) };
});
window.renderer = renderer.getContext().getParameter(renderer.getContext().RENDERER);
window.revision = THREE.REVISION;
</script>`;

const types = { js: 'text/javascript', html: 'text/html' };
const server = createServer((request, response) => {
  const path = new URL(request.url, 'http://x').pathname;
  try {
    const body = path === '/' ? page : path.startsWith('/three/') && !path.includes('..') ? readFileSync(join(three, path.slice(7)))
      : path === '/env_pmrem.ktx2' ? readFileSync(file) : null;
    response.writeHead(body ? 200 : 404, { 'content-type': types[path === '/' ? 'html' : path.split('.').pop()] ?? 'application/octet-stream' });
    response.end(body ?? '');
  } catch (e) {
    response.writeHead(404).end(String(e));
  }
}).listen(0, '127.0.0.1');
await new Promise(done => server.once('listening', done));

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
    '--disable-sync', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
const tab = await browser.newPage();
tab.on('console', m => console.error('page:', m.text()));
tab.on('pageerror', e => console.error('page:', e.message));
await tab.goto(`http://127.0.0.1:${server.address().port}/`);
await tab.waitForFunction('window.revision', undefined, { timeout: 300000 });
const { result, revision, renderer } = await tab.evaluate('({ result, revision, renderer })');
await browser.close();
server.close();

// Our values: every level at the directions that three.js looks up.
const normalize = v => v.map(x => x / Math.hypot(...v));
const look = (n, r) => {
  const v = n[2];
  const reflect = [2 * v * n[0], 2 * v * n[1], 2 * v * n[2] - 1];
  const t = r ** 4;
  return normalize(reflect.map((x, c) => x * (1 - t) + n[c] * t));
};
const sample = (level, directions) => {
  const csv = join(dir, 'd.csv');
  writeFileSync(csv, 'x,y,z\n' + directions.map(d => d.join(',')).join('\n') + '\n');
  return JSON.parse(run('sample', file, '--level', String(level), '-d', csv, '--json', '-q')).rgb;
};
console.log(`three.js r${revision}, ${renderer}; levels ${last + 1}`);
console.log('roughness   lod of three (expected)   rms error   bias   worst   pixels');
let worst = 0;
for (const { r, pixels } of result) {
  const normals = pixels.map(p => p.n);
  const diffuse = sample(last, normals);
  // Beyond the last level but one only E (1 − f) can be measured, lod = last − 1 + f: there f is the formula's.
  const nominal = last * r * (2 - r);
  const f = nominal - (last - 1);
  if (f > 0) pixels.forEach(p => { p.values[1] = p.values[1].map(a => a / (1 - f)); });
  const lods = pixels.map(({ values: [, e, c] }) => f > 0 ? nominal : (c[0] - (1 - e[0])) / e[0] * last);
  const directions = normals.map(n => look(n, r));
  const levels = new Map();
  for (const lod of lods) for (const m of [Math.floor(lod), Math.min(Math.floor(lod) + 1, last)])
    if (!levels.has(m)) levels.set(m, sample(m, directions));
  let e2 = 0, r2 = 0, e1 = 0, r1 = 0, most = 0;
  pixels.forEach(({ values: [got, [e]] }, k) => {
    const m = Math.min(Math.floor(lods[k]), last - 1), t = lods[k] - m;
    for (let c = 0; c < 3; c++) {
      const light = levels.get(m)[k][c] * (1 - t) + (levels.get(m + 1) ?? levels.get(m))[k][c] * t;
      const want = e * light + (1 - e) * diffuse[k][c];
      e2 += (got[c] - want) ** 2; r2 += want ** 2; e1 += got[c] - want; r1 += want;
      most = Math.max(most, Math.abs(got[c] / want - 1));
    }
  });
  const rms = Math.sqrt(e2 / r2);
  worst = Math.max(worst, rms);
  const mean = lods.reduce((a, b) => a + b) / lods.length;
  console.log(`${r.toFixed(2)}        ${mean.toFixed(3)} (${nominal.toFixed(3)})             ${rms.toExponential(2)}   ${(e1 / r1).toExponential(1)}   ${most.toExponential(1)}   ${pixels.length}`);
}
rmSync(dir, { recursive: true });
if (!(worst < 0.02)) { console.log(`FAILED: rms error ${worst}`); process.exit(1); }
console.log('three.js shows what the file holds');
