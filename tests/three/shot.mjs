// Draws an octahedral impostor with three.js in headless Chromium and saves a picture.
//
//   node shot.mjs FOLDER OUT.png [--from x,y,z;x,y,z;…] [--size 256] [--columns 4] [--distance 1]
//                 [--show albedo|lit|normal] [--background #808080]
//
// FOLDER is what `forest-bake export --for three` writes.
import { createServer } from 'node:http';
import { readFile, readdir } from 'node:fs/promises';
import { extname, join } from 'node:path';
import { parseArgs } from 'node:util';
import { chromium } from 'playwright-core';

const { positionals: [folder, out], values } = parseArgs({
  allowPositionals: true,
  options: {
    from: { type: 'string', default: '1,0,1;0,0,1;1,1,1;0,1,0' },
    size: { type: 'string', default: '256' },
    columns: { type: 'string', default: '4' },
    distance: { type: 'string', default: '1' },
    show: { type: 'string', default: 'albedo' },
    background: { type: 'string', default: '#808080' },
  },
});
if (!out) throw new Error('usage: node shot.mjs FOLDER OUT.png [options]');
const directions = values.from.split(';').map((d) => d.split(',').map(Number));
const [size, columns, distance] = [values.size, values.columns, values.distance].map(Number);

const here = import.meta.dirname;
const info = (await readdir(folder)).find((name) => name.endsWith('.impostor.json'));
if (!info) throw new Error(`${folder} has no NAME.impostor.json`);
const folders = { page: here, three: join(here, 'node_modules/three'), atlas: folder };
const types = { '.html': 'text/html', '.js': 'text/javascript', '.json': 'application/json', '.png': 'image/png' };
const server = createServer(async (request, response) => {
  const [, first, ...rest] = new URL(request.url, 'http://localhost').pathname.split('/'); // URL has resolved any ..
  try {
    const body = await readFile(join(folders[first], ...rest));
    response.writeHead(200, { 'content-type': types[extname(request.url)] ?? 'application/octet-stream' }).end(body);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((ready) => server.listen(0, '127.0.0.1', ready));

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--disable-quic', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--force-color-profile=srgb'],
});
const complaints = [];
try {
  const rows = Math.ceil(directions.length / columns);
  const page = await browser.newPage({ viewport: { width: columns * size, height: rows * size } });
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && complaints.push(message.text()));
  page.on('pageerror', (error) => complaints.push(String(error)));
  await page.goto(`http://127.0.0.1:${server.address().port}/page/index.html`);
  await page.waitForFunction('window.draw', null, { timeout: 10_000 });
  const options = { info, directions, size, columns, distance, show: values.show, background: values.background };
  const report = await page.evaluate((options) => window.draw(options), options);
  await page.locator('canvas').screenshot({ path: out });
  console.log(JSON.stringify({ ...report, chromium: browser.version() }));
  if (report.glError) complaints.push(`WebGL error ${report.glError}`);
} finally {
  await browser.close();
  server.close();
  complaints.forEach((complaint) => console.error(complaint));
  if (complaints.length) process.exitCode = 1;
}
