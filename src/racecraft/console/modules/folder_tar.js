/* A folder that was dropped, as one tar: `packed(entry)` walks the browser's entries. Names of more than 100 bytes are cut
   between two folders, as tars have it (POSIX.1-1988, ustar); what does not fit even so is left out. */
const BLOCK = 512, text = new TextEncoder();

/** @param {any} entry a FileSystemDirectoryEntry @returns {Promise<File>} */
export async function packed(entry) {
  const parts = /** @type {BlobPart[]} */ ([]);
  for await (const [path, file] of filesOf(entry, "")) {
    const head = header(path, file.size);
    if (head) parts.push(head, file, new Uint8Array(-file.size & (BLOCK - 1)));
  }
  return new File([...parts, new Uint8Array(2 * BLOCK)], `${entry.name}.tar`);
}

async function* filesOf(entry, above) {
  const path = above + entry.name;
  if (entry.isFile) { yield [path, await new Promise((done, fail) => entry.file(done, fail))]; return; }
  const reader = entry.createReader();
  for (let some; (some = await new Promise((done, fail) => reader.readEntries(done, fail))).length;)   // a hundred at a time
    for (const one of some) yield* filesOf(one, `${path}/`);
}

function header(path, size) {
  const cut = path.length <= 100 ? -1 : path.indexOf("/", path.length - 101);
  const [prefix, name] = [path.slice(0, Math.max(cut, 0)), path.slice(cut + 1)].map(part => text.encode(part));
  if (prefix.length > 155 || name.length > 100) return null;
  const head = new Uint8Array(BLOCK);
  const put = (at, words) => head.set(typeof words === "string" ? text.encode(words) : words, at);
  put(0, name); put(100, "0000644\0"); put(124, `${size.toString(8).padStart(11, "0")}\0`); put(136, "00000000000\0");
  put(148, "        "); put(156, "0"); put(257, "ustar\x0000"); put(345, prefix);
  put(148, `${head.reduce((sum, byte) => sum + byte, 0).toString(8).padStart(6, "0")}\0 `);
  return head;
}
