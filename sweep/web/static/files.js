// Files: their bytes in base64, and how they are saved.

import { make } from "./dom.js";

/** @param {string} name @param {string} mime @param {BlobPart} bytes */
export function download(name, mime, bytes) {
  const address = URL.createObjectURL(new Blob([bytes], { type: mime }));
  make("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

// A loop is many times as fast as Uint8Array.from.
/** @param {string} base64 */
export function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}
