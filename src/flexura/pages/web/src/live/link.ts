import { type Received, received } from "./protocol";

const PAUSES = [300, 600, 1200, 2500, 5000];
const FORBIDDEN = 4403;

/** The WebSocket of the page; when it is cut it is tried again, until the server says no. */
export class Link {
  private socket: WebSocket | null = null;
  private tries = 0;

  constructor(
    private readonly take: (own: Received) => void,
    private readonly tell: (state: "open" | "cut" | "refused", seconds: number) => void,
  ) {
    this.open();
  }

  get isOpen(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** Send what can be sent; what cannot is asked for again when the page is connected. */
  send(message: object): void {
    if (this.isOpen) this.socket?.send(JSON.stringify(message));
  }

  private open(): void {
    const address = new URL("socket", location.href);
    address.protocol = "ws:";
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.tries = 0;
      this.tell("open", 0);
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.take(received(event.data));
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      if (event.code === FORBIDDEN) return this.tell("refused", 0);
      const pause = PAUSES[Math.min(this.tries++, PAUSES.length - 1)];
      this.tell("cut", pause / 1000);
      setTimeout(() => this.open(), pause);
    };
    this.socket = socket;
  }
}

/** What is said of the connection; nothing of one that stands. */
export function toldOfLink(state: "open" | "cut" | "refused", seconds: number): string {
  if (state === "open") return "";
  return state === "refused" ? "The server refuses this page: open the address that it printed." : `The connection is cut: what is shown does not follow. Next try in ${seconds} s.`;
}
