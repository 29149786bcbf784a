// Reads what reports/replay_encoding.py wrote: deflated differences of whole numbers back into columns, lines and floors.
const Decode = (() => {
  async function inflate(base64) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).arrayBuffer();
  }

  async function json(base64) {
    return JSON.parse(new TextDecoder().decode(await inflate(base64)));
  }

  // {name: Float64Array}, NaN in a gap
  async function columns(block) {
    const buffer = await inflate(block.data);
    const raw = block.wide ? new Int32Array(buffer) : new Int16Array(buffer);
    const gap = block.wide ? -2147483648 : -32768;
    const out = {};
    block.columns.forEach(([name, first, unit], c) => {
      const values = new Float64Array(block.n);
      let whole = first;
      for (let i = 0; i < block.n; i++) {
        const step = raw[c * block.n + i];
        if (step === gap) values[i] = NaN;
        else values[i] = (whole += step) * unit;
      }
      out[name] = values;
    });
    return out;
  }

  function line(flat) {
    const points = [];
    let x = 0, y = 0;
    for (let i = 0; i < flat.length; i += 2) points.push([(x += flat[i]) * 0.01, (y += flat[i + 1]) * 0.01]);
    return points;
  }

  // Snapshots with every line spelled out (0 means: as in the snapshot before).
  async function thoughts(base64) {
    const last = {};
    return (await json(base64)).map((entry) => {
      const lines = {};
      for (const [name, flat] of Object.entries(entry.lines)) lines[name] = last[name] = flat === 0 ? last[name] : line(flat);
      const metres = (rows) => rows && rows.map((row) => row.map((v) => v * 0.01));
      const circles = Object.fromEntries(Object.entries(entry.circles || {}).map(([name, rows]) => [name, metres(rows)]));
      const field = entry.field && { ...entry.field, data: Uint8Array.from(atob(entry.field.data), (c) => c.charCodeAt(0)) };
      return { ...entry, lines, circles, field, tube: metres(entry.tube), tree: metres(entry.tree) };
    });
  }

  return { json, columns, thoughts };
})();
