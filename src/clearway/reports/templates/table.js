// The table of trials: sorts, filters, pages; builds cells as text only.
const Trials = (() => {
  const source = document.getElementById("trial-rows");
  if (!source) return null;
  const { columns, page, total, ...sample } = JSON.parse(source.textContent);
  let rows = sample.rows, haystacks = null;
  const table = document.getElementById("trial-table"), body = table.tBodies[0];
  const found = document.getElementById("found"), search = document.getElementById("search");
  const failed = document.getElementById("failures-only");
  const filters = columns.map(() => "");
  let sorted = { column: 0, down: false }, first = 0, shown = rows;

  // Of a measured trial: the uncertainty of a value; or, where there is none, its bounds and why.
  const measured = (row, c) => (row[columns.length + 1] || {})[c];

  const text = (row, c) => {
    const value = row[c], more = measured(row, c);
    if (value === null) return (Array.isArray(more) && more[0]) || "–";
    let digits = columns[c].digits;
    if (typeof value !== "number" || digits === undefined) return String(value);
    if (typeof more !== "number") return value.toFixed(digits);
    while (digits < 6 && Number(more.toFixed(digits)) === 0) digits++;
    return `${value.toFixed(digits)} ± ${more.toFixed(digits)}`;
  };
  const haystack = (row) => columns.map((_, c) => text(row, c)).join(" ").toLowerCase();

  // A filter of a column of numbers may be `>0.5`, `<=3`, `0.2..0.6` or a number; of text, a part of it.
  function accepts(c, wanted) {
    const want = wanted.trim().toLowerCase();
    if (!want) return null;
    if (columns[c].choices) return (row) => String(row[c]) === wanted;
    const bound = /^(<=|>=|<|>|=)\s*(-?[\d.]+)$/.exec(want), range = /^(-?[\d.]+)\s*\.\.\s*(-?[\d.]+)$/.exec(want);
    if (bound) {
      const limit = Number(bound[2]);
      const test = { "<": (x) => x < limit, ">": (x) => x > limit, "<=": (x) => x <= limit, ">=": (x) => x >= limit, "=": (x) => x === limit }[bound[1]];
      return (row) => typeof row[c] === "number" && test(row[c]);
    }
    if (range) return (row) => typeof row[c] === "number" && row[c] >= Number(range[1]) && row[c] <= Number(range[2]);
    return (row) => text(row, c).toLowerCase().includes(want);
  }

  function compare(a, b) {
    if (a === null || b === null) return (a === null) - (b === null);
    return typeof a === "number" ? a - b : String(a).localeCompare(String(b), undefined, { numeric: true });
  }

  function update() {
    const tests = filters.map((wanted, c) => accepts(c, wanted)).filter(Boolean);
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    if (words.length && !haystacks) haystacks = rows.map(haystack);
    shown = rows.filter((row, i) => (!failed.checked || row[columns.length]) && words.every((w) => haystacks[i].includes(w)) && tests.every((test) => test(row)));
    const { column, down } = sorted;
    shown.sort((a, b) => {
      if (a[column] === null || b[column] === null) return compare(a[column], b[column]); // what is missing stays last
      return (down ? -1 : 1) * compare(a[column], b[column]) || a[0] - b[0];
    });
    first = 0;
    draw();
  }

  function draw() {
    const fragment = document.createDocumentFragment();
    for (const row of shown.slice(first, first + page)) {
      const tr = document.createElement("tr");
      columns.forEach((column, c) => {
        const td = document.createElement("td");
        if (c === 0) {
          const link = document.createElement("a");
          link.href = `#replay-${row[0]}`; link.textContent = text(row, 0); link.title = "replay this trial";
          td.append(link);
        } else td.textContent = text(row, c);
        if (column.number) td.className = "n";
        if (column.words) { td.className = "words"; if (row[c] === null || row[c] === "") td.textContent = ""; }
        if (row[c] === null && Array.isArray(measured(row, c))) td.title = measured(row, c)[1];
        if (column.why) { td.className = "why bad"; if (row[c] === null) td.textContent = ""; }
        tr.append(td);
      });
      if (row[columns.length]) tr.className = "fail";
      fragment.append(tr);
    }
    body.replaceChildren(fragment);
    const last = Math.min(first + page, shown.length);
    found.textContent = shown.length ? `${first + 1}–${last} of ${shown.length}${shown.length < rows.length ? ` (of ${rows.length})` : ""}${rows.length < total ? `, a sample of ${total}` : ""}` : "no trial matches";
    document.getElementById("page-back").disabled = first === 0;
    document.getElementById("page-on").disabled = last >= shown.length;
  }

  const head = table.tHead, names = head.rows[0], fields = head.rows[1];
  columns.forEach((column, c) => {
    const th = document.createElement("th"), button = document.createElement("button"), cell = document.createElement("td");
    th.scope = "col";
    button.type = "button"; button.textContent = column.unit ? `${column.name} (${column.unit})` : column.name; button.title = column.title || "sort";
    button.addEventListener("click", () => {
      sorted = { column: c, down: sorted.column === c && !sorted.down };
      [...names.cells].forEach((other, k) => (k === c ? other.setAttribute("aria-sort", sorted.down ? "descending" : "ascending") : other.removeAttribute("aria-sort")));
      update();
    });
    th.append(button);
    if (column.number) th.className = "n";
    names.append(th);
    let field;
    if (column.choices) {
      field = document.createElement("select");
      field.add(new Option("all", ""));
      for (const choice of column.choices) field.add(new Option(choice, choice));
    } else { field = document.createElement("input"); field.title = column.number ? "such as >0.5, <=3, 0.2..0.6" : "part of the text"; }
    field.className = "filter";
    field.setAttribute("aria-label", `filter by ${column.name}`);
    field.addEventListener("input", () => { filters[c] = field.value; update(); });
    cell.append(field);
    fields.append(cell);
  });
  search.addEventListener("input", update);
  failed.addEventListener("change", update);
  document.getElementById("page-back").addEventListener("click", () => { first = Math.max(0, first - page); draw(); });
  document.getElementById("page-on").addEventListener("click", () => { first += page; draw(); });
  // The rows of every trial, where the page itself lists a sample: a script beside the page calls this by name.
  const every = document.getElementById("every-trial");
  window.clearwayTable = (all) => { rows = all; haystacks = null; every.hidden = true; update(); };
  every.hidden = rows.length >= total;
  every.textContent = `List all ${total}`;
  every.addEventListener("click", () => {
    const script = document.createElement("script");
    script.src = every.dataset.file;
    script.onerror = () => { found.textContent = `${script.src} is missing beside this page`; };
    document.head.append(script);
  });
  names.cells[0].setAttribute("aria-sort", "ascending");
  update();
  return { count: () => shown.length };
})();
