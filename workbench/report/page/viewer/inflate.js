// ---- deflate, undone (RFC 1951): what `zlib` of workbench/motion/packing.py wrote -----------------------------
// Every block of every kind; no checks beyond those that end a wrong stream: the page holds what it wrote.
function inflate(given, length) {
  const out = new Uint8Array(length);
  let at = 0, bit = 0, made = 0;
  const bits = (n) => {
    let value = 0;
    for (let k = 0; k < n; k++, bit++) value |= ((given[bit >> 3] >> (bit & 7)) & 1) << k;
    return value;
  };
  function codes(lengths) {                                  // canonical Huffman: how many of a length, and which
    const count = new Uint16Array(16), place = new Uint16Array(16), symbols = new Uint16Array(lengths.length);
    for (const n of lengths) count[n]++;
    count[0] = 0;
    for (let n = 1; n < 16; n++) place[n] = place[n - 1] + count[n - 1];
    lengths.forEach((n, symbol) => { if (n) symbols[place[n]++] = symbol; });
    return { count, symbols };
  }
  function symbol({ count, symbols }) {
    let code = 0, first = 0, index = 0;
    for (let n = 1; n < 16; n++, bit++) {
      code |= (given[bit >> 3] >> (bit & 7)) & 1;
      if (code - first < count[n]) { bit++; return symbols[index + code - first]; }
      index += count[n];
      first = (first + count[n]) << 1;
      code <<= 1;
    }
    throw new Error("a stream that deflate did not write");
  }
  const ramp = (first, each, count) => {                     // bases and further bits of lengths and distances
    const base = [], more = [];
    for (let k = 0, value = first; k < count; k++) {
      more.push(Math.max(0, Math.floor(k / each) - 1));
      base.push(value);
      value += 1 << more[k];
    }
    return { base, more };
  };
  const long = ramp(3, 4, 28), far = ramp(1, 2, 30);
  long.base.push(258); long.more.push(0);
  const order = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
  const fixed = [
    codes(Array.from({ length: 288 }, (_, k) => k < 144 ? 8 : k < 256 ? 9 : k < 280 ? 7 : 8)), codes(Array(30).fill(5)),
  ];
  function told() {                                          // the codes of a block that brings its own
    const literals = bits(5) + 257, distances = bits(5) + 1, n = bits(4) + 4, lengths = Array(19).fill(0), all = [];
    for (let k = 0; k < n; k++) lengths[order[k]] = bits(3);
    const code = codes(lengths);
    while (all.length < literals + distances) {
      const s = symbol(code);
      if (s < 16) all.push(s);
      else {
        const again = s === 16 ? all[all.length - 1] : 0;
        for (let k = s === 16 ? 3 + bits(2) : s === 17 ? 3 + bits(3) : 11 + bits(7); k > 0; k--) all.push(again);
      }
    }
    return [codes(all.slice(0, literals)), codes(all.slice(literals))];
  }
  for (let last = 0; !last;) {
    last = bits(1);
    const kind = bits(2);
    if (kind === 0) {
      at = (bit + 7) >> 3;
      const n = given[at] | (given[at + 1] << 8);
      out.set(given.subarray(at + 4, at + 4 + n), made);
      made += n;
      bit = 8 * (at + 4 + n);
      continue;
    }
    const [literal, distance] = kind === 1 ? fixed : told();
    for (let s = symbol(literal); s !== 256; s = symbol(literal)) {
      if (s < 256) { out[made++] = s; continue; }
      const n = long.base[s - 257] + bits(long.more[s - 257]), d = symbol(distance);
      const back = far.base[d] + bits(far.more[d]);
      for (let k = 0; k < n; k++, made++) out[made] = out[made - back];
    }
  }
  return out;
}
