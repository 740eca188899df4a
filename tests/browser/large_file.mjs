// A file of 200 MB, as scans have, and a slow way to a daemon, on which one sees it go.
import { closeSync, openSync, writeSync } from 'node:fs';
import { connect, createServer } from 'node:net';

/** Writes an OBJ of over 200 MB, of squares that each name their four points; returns its bytes. */
export function writeLarge(path) {
  const squares = Array.from({ length: 16000 }, (_, i) => {
    const [x, z] = [(i % 128) / 128, Math.floor(i / 128) / 128].map((value) => value.toFixed(6));
    return `v ${x} 0 ${z}\nv ${x} 1 ${z}\nv ${x} 1 -${z}\nv ${x} 0 -${z}\nf -4 -3 -2 -1\n`;
  });
  const part = Buffer.from(squares.join(''));
  const file = openSync(path, 'wx');
  let size = 0;
  while (size < 200e6) size += writeSync(file, part);
  closeSync(file);
  return size;
}

/** Listens in front of a daemon, and passes on so many bytes a second to it: {url, close()}. */
export async function slowWayTo(daemon, rate) {
  const { hostname, port } = new URL(daemon.url);
  const ends = new Set();
  const server = createServer((near) => {
    const far = connect(Number(port), hostname);
    far.pipe(near);
    near.on('data', (bytes) => {
      far.write(bytes);
      near.pause();
      setTimeout(() => near.resume(), (1000 * bytes.length) / rate);
    });
    near.on('end', () => far.end());
    for (const [end, other] of [[near, far], [far, near]]) {
      ends.add(end);
      end.on('error', () => {}); // a browser leaves when it likes
      end.on('close', () => other.destroy());
    }
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { url: `http://127.0.0.1:${server.address().port}`, close: () => {
    server.close();
    for (const end of ends) end.destroy();
  } };
}
