// Draws all levels of a glb side by side with three.js in headless Chromium, after the Khronos validator has
// passed it, and saves a picture: the upper row at rest, the lower one in the wind by the file's attributes.
//
//   node levels.mjs FILE.glb OUT.png [--size 256]
import { readFile } from 'node:fs/promises';
import { basename, dirname } from 'node:path';
import { parseArgs } from 'node:util';
import { validateBytes } from 'gltf-validator';
import { shoot } from './browser.mjs';

const { positionals: [file, out], values } = parseArgs({
  allowPositionals: true,
  options: { size: { type: 'string', default: '256' } },
});
if (!out) throw new Error('usage: node levels.mjs FILE.glb OUT.png [--size 256]');

const { issues } = await validateBytes(new Uint8Array(await readFile(file)), {
  maxIssues: 0,
  // It knows no extension of vendors, and takes what only such an extension uses for unused.
  ignoredIssues: ['UNSUPPORTED_EXTENSION', 'UNUSED_OBJECT'],
});
issues.messages.forEach(({ code, message, pointer }) => console.error(`${code} ${pointer}: ${message}`));
console.log(JSON.stringify({ errors: issues.numErrors, warnings: issues.numWarnings, infos: issues.numInfos }));
if (issues.numErrors + issues.numWarnings) throw new Error(`${file}: the validator does not pass it`);

const json = await levels(file);
const size = Number(values.size);
const options = { file: basename(file), levels: json, size };
await shoot({ page: 'levels.html', folder: dirname(file), width: json.length * size, height: 2 * size, options, out });

/** Numbers of the nodes, finest first. */
async function levels(file) {
  const bytes = await readFile(file);
  const { nodes } = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)));
  return [0, ...(nodes[0].extensions?.MSFT_lod.ids ?? [])];
}
