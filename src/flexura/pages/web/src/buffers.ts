import type { Buffer } from "./scene";

export type Numbers = Float32Array | Uint32Array | Int16Array | Uint8Array;

const TYPES = { f32: Float32Array, u32: Uint32Array, i16: Int16Array, u8: Uint8Array };

function bytesOfBase64(text: string): Uint8Array<ArrayBuffer> {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return bytes;
}

/** What is stored in a buffer, not yet multiplied by its scale. Throws when the count of numbers is not its shape's. */
export async function decode(buffer: Buffer, binary?: ArrayBuffer): Promise<Numbers> {
  const type = TYPES[buffer.dtype];
  const count = buffer.shape.reduce((a, b) => a * b, 1);
  let numbers: Numbers;
  if (buffer.data === undefined) {
    if (!binary) throw new Error("a buffer of a binary message without the message");
    numbers = new type(binary, buffer.offset ?? 0, (buffer.bytes ?? 0) / type.BYTES_PER_ELEMENT);
  } else if (count === 0) {
    numbers = new type(0);
  } else {
    const stream = new Blob([bytesOfBase64(buffer.data)]).stream().pipeThrough(new DecompressionStream("deflate"));
    numbers = new type(await new Response(stream).arrayBuffer());
  }
  if (numbers.length !== count) throw new Error(`a buffer of shape ${buffer.shape} holds ${numbers.length} numbers`);
  return numbers;
}

/** Numbers of a buffer with its scale, as floats. */
export async function floats(buffer: Buffer, binary?: ArrayBuffer): Promise<Float32Array> {
  const stored = await decode(buffer, binary);
  if (stored instanceof Float32Array && buffer.scale === undefined) return stored;
  return Float32Array.from(stored, (n) => n * (buffer.scale ?? 1));
}
