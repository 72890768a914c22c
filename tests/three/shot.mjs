// Draws an octahedral impostor with three.js in headless Chromium and saves a picture.
//
//   node shot.mjs FOLDER OUT.png [--from x,y,z;x,y,z;…] [--size 256] [--columns 4] [--distance 1]
//                 [--show albedo|lit|normal] [--background #808080]
//
// FOLDER is what `forest-bake export --for three` writes.
import { readdir } from 'node:fs/promises';
import { parseArgs } from 'node:util';
import { shoot } from './browser.mjs';

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

const info = (await readdir(folder)).find((name) => name.endsWith('.impostor.json'));
if (!info) throw new Error(`${folder} has no NAME.impostor.json`);
const rows = Math.ceil(directions.length / columns);
const options = { info, directions, size, columns, distance, show: values.show, background: values.background };
await shoot({ page: 'index.html', folder, width: columns * size, height: rows * size, options, out });
