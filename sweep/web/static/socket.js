// A socket to the server that started the page, opened again whenever it was dropped.

import { randomName } from "./dom.js";

/** @import { Listener, Message } from "./protocol.d.ts" */

const FIRST_WAIT = 300; // ms
const LONGEST_WAIT = 8000;
/** @type {Record<number, string>} */
const OVER = {
  4001: "This run continues in another window.",
  4002: "The server has no run for this page.",
};

export const PAGE = "boidsweep-page";

export function pageId() {
  const known = sessionStorage.getItem(PAGE) ?? randomName();
  sessionStorage.setItem(PAGE, known);
  return known;
}

export class Socket {
  // The view sets these, to listen.
  /** @type {Listener["onopen"]} */
  onopen = () => {};
  /** @type {Listener["onmessage"]} */
  onmessage = () => {};
  /** @type {Listener["onclose"]} */
  onclose = () => {};
  /** @type {WebSocket | null} */
  socket = null;

  constructor() {
    this.address = new URL("socket", location.href);
    this.address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    this.wait = FIRST_WAIT;
    this.closed = false;
  }

  start() {
    const socket = new WebSocket(this.address);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.wait = FIRST_WAIT;
      this.onopen();
    };
    socket.onmessage = ({ data }) =>
      this.onmessage(typeof data === "string" ? JSON.parse(data) : data);
    socket.onclose = ({ code }) => {
      if (OVER[code]) this.onclose(OVER[code]);
      else this.again();
    };
  }

  again() {
    if (this.closed) return;
    const wait = `Trying again in ${Math.ceil(this.wait / 1000)} s`;
    this.onclose(`The connection is lost. ${wait}; is sweep view still running?`);
    setTimeout(() => this.start(), this.wait);
    this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
  }

  /** @param {Message} message */
  send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) {
      this.socket.send(JSON.stringify(message));
    }
  }

  close() {
    this.closed = true;
    this.socket?.close();
  }
}
