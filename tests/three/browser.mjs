// Pages of this folder in headless Chromium.
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join } from 'node:path';
import { chromium } from 'playwright-core';

const here = import.meta.dirname;
const types = { '.html': 'text/html', '.js': 'text/javascript', '.json': 'application/json', '.png': 'image/png' };

/** Opens a page that has window.draw(options), calls that, saves a picture of its canvas and prints what it returned.
 *  The page finds the files of `folder` under /data. What the browser complains of fails the run. */
export async function shoot({ page: name, folder, width, height, options, out }) {
  const folders = { page: here, three: join(here, 'node_modules/three'), data: folder };
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
    const page = await browser.newPage({ viewport: { width, height } });
    page.on('console', (message) => ['error', 'warning'].includes(message.type()) && complaints.push(message.text()));
    page.on('pageerror', (error) => complaints.push(String(error)));
    await page.goto(`http://127.0.0.1:${server.address().port}/page/${name}`);
    await page.waitForFunction('window.draw', null, { timeout: 10_000 });
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
}
