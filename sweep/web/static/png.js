// What a PNG says of itself: texts in its chunks, and how many pixels are an inch.

const HEAD = 33; // bytes: the signature, and the chunk IHDR, which is always first
const INCHES = 39.3701; // a metre

const TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let sum = byte;
  for (let bit = 0; bit < 8; bit++) {
    sum = sum & 1 ? (sum >>> 1) ^ 0xedb88320 : sum >>> 1;
  }
  return sum;
});

// The checksum of a chunk.
/** @param {Uint8Array} bytes */
function checksum(bytes) {
  let sum = 0xffffffff;
  for (const byte of bytes) sum = (sum >>> 8) ^ TABLE[(sum ^ byte) & 255];
  return (sum ^ 0xffffffff) >>> 0;
}

/** @param {string} name @param {Uint8Array} content */
function chunk(name, content) {
  const bytes = new Uint8Array(content.length + 12);
  const view = new DataView(bytes.buffer);
  view.setUint32(0, content.length);
  bytes.set(new TextEncoder().encode(name), 4);
  bytes.set(content, 8);
  view.setUint32(content.length + 8, checksum(bytes.subarray(4, content.length + 8)));
  return bytes;
}

// Any letters may stand in it, in UTF-8.
/** @param {string} key @param {string} text */
const words = (key, text) =>
  chunk("iTXt", new TextEncoder().encode(`${key}\0\0\0\0\0${text}`));

/** @param {number} perInch */
function density(perInch) {
  const view = new DataView(new ArrayBuffer(9));
  for (const at of [0, 4]) view.setUint32(at, Math.round(perInch * INCHES));
  view.setUint8(8, 1); // a metre
  return chunk("pHYs", new Uint8Array(view.buffer));
}

// The same picture with these texts, for printing at so many pixels an inch.
/**
 * @param {Uint8Array<ArrayBuffer>} png
 * @param {Record<string, string>} about
 * @param {number} perInch
 */
export const labelled = (png, about, perInch) => [
  png.slice(0, HEAD),
  density(perInch),
  ...Object.entries(about).map(([key, text]) => words(key, text)),
  png.slice(HEAD),
];
