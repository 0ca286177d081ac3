// What the server has packed for a page that opens from disk.

import { bytesOf } from "./files.js";

/** @param {string} text */
export async function unpacked(text) {
  const packed = new Blob([bytesOf(text)]).stream();
  const stream = packed.pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// So many frames: the text has the differences of each byte from frame to frame.
/** @param {string} text @param {number} count */
export async function framesOf(text, count) {
  const differences = await unpacked(text);
  const frames = new Uint8Array(differences.length);
  const size = frames.length / count;
  let from = 0;
  for (let at = 0; at < size; at++) {
    let byte = 0;
    for (let to = at; to < frames.length; to += size) {
      byte += differences[from++];
      frames[to] = byte; // modulo 256
    }
  }
  return frames;
}
