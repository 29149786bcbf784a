// The player: picks a trial, and one beside it, runs their clock, and asks Stage to draw. Robots of one simulation show their plans too.
const Replay = (() => {
  const $ = (id) => document.getElementById(id);
  const meta = JSON.parse($("replay-index").textContent);
  const waiting = new Map();
  let trial = null, beside = null, fellows = [], end = 0, time = 0, playing = false, last = 0, toTime = null, asked = 0;

  // Replays beside the page call this by name.
  window.clearwayTrial = (packed) => { waiting.get(packed.index)?.(packed); waiting.delete(packed.index); };

  function packedTrial(index) {
    const inline = $(`trial-${index}`);
    if (inline) return Promise.resolve(JSON.parse(inline.textContent));
    return new Promise((resolve, reject) => {
      waiting.set(index, resolve);
      const script = document.createElement("script");
      script.src = `${meta.folder}/${String(index).padStart(5, "0")}.js`;
      script.onerror = () => reject(new Error(`${script.src} is missing beside this page. ${meta.one}`.trim()));
      document.head.append(script);
    });
  }

  async function open(packed) {
    const floor = await Decode.json(meta.floors[packed.floor]);
    const samples = await Decode.columns(packed.samples), thoughts = await Decode.thoughts(packed.thoughts);
    const fixed = [...floor, ...packed.obstacles], robot = meta.robots[packed.robot];
    const box = (xs) => xs.reduce(([a, b], x) => [Math.min(a, x), Math.max(b, x)], [Infinity, -Infinity]);
    const known = (values) => Array.from(values || []).filter((x) => x !== null && !Number.isNaN(x));
    const corners = (axis) => {
      const own = [...known(samples[axis ? "y" : "x"]), ...known(packed.legs.flatMap((l) => [l.start[axis], l.goal[axis]]))];
      if (!own.length) own.push(-1, 1); // nothing was recorded, and nobody knows where the goals were
      const [low, high] = box(own); // a moving obstacle may go far away: what it does there doesn't matter
      const clipped = packed.movingObstacles.flatMap((_, m) => known(samples[`m${m}${axis ? "y" : "x"}`]).map((x) => Math.min(Math.max(x, low - 2), high + 2)));
      return [...own, ...clipped];
    };
    const around = (xs, ys, margin) => { const [a, b] = box(xs), [c, d] = box(ys); return [a - margin, c - margin, b + margin, d + margin]; };
    const near = around(corners(0), corners(1), 0.9);
    const outlines = fixed.flatMap((b) => (b.cross ? [b.at] : b.r !== undefined ? [[b.at[0] - b.r, b.at[1] - b.r], [b.at[0] + b.r, b.at[1] + b.r]] : Lidar.place(b.p, b.at)));
    const all = around([...corners(0), ...outlines.map((p) => p[0])], [...corners(1), ...outlines.map((p) => p[1])], 0.3);
    return {
      ...packed, samples, thoughts, fixed, robot, world: Lidar.scene(fixed.filter((b) => !b.cross)),
      end: samples.t[samples.t.length - 1] || 0,
      bounds: (whole) => (whole ? all : near),
      thoughtAt: (t) => thoughts.findLast((entry) => entry.t <= t + 1e-6),
    };
  }

  // The state of a trial at `t`, between samples interpolated.
  function at(trial, t) {
    const s = trial.samples, n = s.t.length;
    let low = 0, high = n - 1;
    while (high - low > 1) { const mid = (low + high) >> 1; if (s.t[mid] <= t) low = mid; else high = mid; }
    if (n > 1 && t >= s.t[high]) low = high;
    const next = Math.min(low + 1, n - 1), span = s.t[next] - s.t[low], f = span > 0 ? Math.min(Math.max((t - s.t[low]) / span, 0), 1) : 0;
    const mix = (name) => { const a = s[name][low], b = s[name][next]; return Number.isNaN(b) ? a : a + f * (b - a); };
    const pose = (p) => { const at = ["x", "y", "a"].map((axis) => mix(p + axis)); return at.slice(0, 2).every(Number.isFinite) ? at : null; };
    return {
      t, index: low, pose: pose(""), estimate: s.ex ? pose("e") : null, movingObstacles: trial.movingObstacles.map((_, m) => pose(`m${m}`)),
      v: s.v ? mix("v") : NaN, w: s.w ? mix("w") : NaN, clearance: s.c ? mix("c") : NaN,
      contact: trial.outcome === "collision" && t >= trial.end - 0.2,
    };
  }

  const number = (x, digits, unit) => (Number.isFinite(x) ? `${x.toFixed(digits).replace(/^-(0\.?0*)$/, "$1")} ${unit}` : "–");

  function render() {
    if (!trial) return;
    const now = at(trial, time), options = Object.fromEntries(["scan", "plan", "path", "estimate", "whole"].map((k) => [k, $(`show-${k}`).checked]));
    const shown = (beside ? [trial, beside] : [trial]).map((one) => one.bounds(options.whole)); // both to one scale
    options.bounds = [Math.min, Math.min, Math.max, Math.max].map((most, k) => most(...shown.map((bounds) => bounds[k])));
    Stage.draw($("stage"), trial, now, options, fellows);
    if (beside) Stage.draw($("stage-beside"), beside, at(beside, time), options, []);
    toTime = Stage.chart($("clearance"), beside ? [trial, beside] : [trial], time, end);
    $("scrub").value = String(time);
    $("scrub").setAttribute("aria-valuetext", `${time.toFixed(1)} of ${end.toFixed(1)} seconds`);
    $("clock").textContent = `${time.toFixed(1)} / ${end.toFixed(1)} s`;
    const off = now.estimate && now.pose ? Math.hypot(now.estimate[0] - now.pose[0], now.estimate[1] - now.pose[1]) : NaN;
    const thought = trial.thoughtAt(time), leg = trial.legs[trial.samples.leg[now.index]];
    for (const [id, text] of [
      ["now-leg", leg ? leg.name : "–"], ["now-speed", number(now.v, 2, "m/s")], ["now-turn", number(now.w, 2, "rad/s")],
      ["now-clearance", number(now.clearance, 3, "m")], ["now-error", number(100 * off, 1, "cm")], ["now-status", thought?.status || "–"],
    ]) $(id).textContent = text;
  }

  function seek(t) { if (trial) { time = Math.min(Math.max(t, 0), end); render(); } }

  function step(samples) {
    if (!trial) return;
    const s = trial.samples.t, i = Math.min(Math.max(at(trial, time).index + samples, 0), s.length - 1);
    play(false); seek(s[i]);
  }

  function tick(stamp) {
    if (!playing) return;
    const passed = Math.min((stamp - last) / 1000, 0.1) * Number($("rate").value);
    last = stamp;
    seek(time + Math.max(passed, 0));
    if (time >= end) play(false); else requestAnimationFrame(tick);
  }

  function play(on) {
    if (!trial || on === playing) return;
    playing = on;
    $("play").textContent = on ? "Pause" : "Play";
    $("play").setAttribute("aria-pressed", String(on));
    if (on) { if (time >= end) time = 0; last = performance.now(); requestAnimationFrame(tick); }
  }

  function describe() {
    const facts = $("facts"), events = $("events");
    facts.replaceChildren(); events.replaceChildren();
    for (const [label, text] of Object.entries(trial.row)) {
      const dt = document.createElement("dt"), dd = document.createElement("dd");
      dt.textContent = label; dd.textContent = text; facts.append(dt, dd);
    }
    $("verdict").textContent = trial.verdict || trial.outcome;
    $("verdict").className = trial.success ? "verdict good" : "verdict bad";
    for (const [t, kind, detail] of trial.events.slice(0, 60)) {
      const item = document.createElement("li"), button = document.createElement("button");
      button.type = "button"; button.textContent = `${t.toFixed(1)} s  ${kind}${detail[0] ? `: ${detail[0]}` : ""}`;
      button.addEventListener("click", () => { play(false); seek(t); });
      item.append(button);
      if (trial.video) {
        const [file, start] = trial.video, link = document.createElement("a");
        link.href = `${file}#t=${Math.max(0, start + t).toFixed(1)}`; link.target = "_blank"; link.textContent = "video";
        item.append(" ", link);
      }
      events.append(item);
    }
    $("no-events").hidden = trial.events.length > 0;
  }

  async function show(index) {
    const mine = ++asked;
    play(false);
    $("replay-problem").hidden = true;
    try {
      const opened = await open(await packedTrial(index));
      const about = listed(index), others = about ? meta.trials.filter((other) => other[0] !== index) : [];
      const together = about?.[3] >= 0 ? others.filter((other) => other[3] === about[3]) : [];
      const along = await Promise.all(together.map(async (other) => open(await packedTrial(other[0]))));
      if (mine !== asked) return; // another was picked meanwhile
      [trial, beside, fellows] = [opened, null, along];
      offer(others.filter((other) => other[2] === about[2]));
    } catch (error) {
      problem(error);
      return;
    }
    time = 0;
    if (![...$("pick").options].some((o) => o.value === String(index))) $("pick").add(new Option(trial.title, index)); // none of the sample
    $("pick").value = String(index);
    $("stage").setAttribute("aria-label", `Floor plan with the robot, trial ${index}`);
    for (const [id, there] of [["plan", trial.thoughts.length > 0], ["estimate", trial.samples.ex !== undefined], ["scan", Stage.scans(trial)]]) $(`layer-${id}`).hidden = !there;
    describe(); settle();
    $("player").dataset.trial = String(index);
  }

  const listed = (index) => meta.trials.find((other) => other[0] === index);

  function problem(error) {
    $("replay-problem").textContent = `This trial can't be shown: ${error.message}`;
    $("replay-problem").hidden = false;
  }

  // Trials of the same test, one of which may be shown beside.
  function offer(others) {
    $("beside").replaceChildren(new Option("nothing beside it", ""), ...others.map(([index, title]) => new Option(title, index)));
    $("beside-it").hidden = !others.length;
  }

  async function showBeside(index) {
    const mine = asked;
    try {
      const opened = index === null ? null : await open(await packedTrial(index));
      if (mine === asked) beside = opened;
    } catch (error) { problem(error); }
    settle();
  }

  // What follows from which trials are shown.
  function settle() {
    end = Math.max(trial.end, beside ? beside.end : 0);
    time = Math.min(time, end);
    $("scrub").max = String(end);
    $("stages").classList.toggle("two", Boolean(beside));
    for (const [id, shown] of [["stage-title", trial], ["stage-beside-title", beside]]) {
      $(id).textContent = beside ? `${shown.row.navigator}: ${shown.verdict || shown.outcome}` : "";
    }
    render();
  }

  function neighbour(by) {
    if (meta.trials.length === meta.total) { // all of them are listed
      const next = meta.trials[$("pick").selectedIndex + by];
      if (next) show(next[0]);
      return;
    }
    const next = Number($("pick").value) + by;
    if (next >= 0 && next < meta.total) show(next);
  }

  function keys(event) {
    if (event.altKey || event.ctrlKey || event.metaKey || ["SELECT", "TEXTAREA"].includes(event.target.tagName)) return;
    const button = event.target.tagName === "BUTTON" || event.target.type === "checkbox";
    const act = {
      " ": button ? null : () => play(!playing), k: () => play(!playing), ArrowRight: () => step(event.shiftKey ? 10 : 1),
      ArrowLeft: () => step(event.shiftKey ? -10 : -1), Home: () => seek(0), End: () => seek(end),
      n: () => neighbour(1), p: () => neighbour(-1),
    }[event.key];
    if (act) { event.preventDefault(); act(); }
  }

  function fromAddress() {
    const match = /^#replay-(\d+)$/.exec(location.hash);
    if (!match) return false;
    show(Number(match[1]));
    scrolled(10);
    return true;
  }

  function scrolled(tries) {  // what stands above it is laid out only once it comes near, and moves it
    $("replay").scrollIntoView();
    const below = parseFloat(getComputedStyle(document.documentElement).scrollPaddingTop) || 0;
    if (tries > 0) setTimeout(() => { if (Math.abs($("replay").getBoundingClientRect().top - below) > 2) scrolled(tries - 1); }, 150);
  }

  function start() {
    for (const [index, title] of meta.trials) $("pick").add(new Option(title, index));
    $("pick").addEventListener("change", () => show(Number($("pick").value)));
    $("beside").addEventListener("change", () => showBeside($("beside").value === "" ? null : Number($("beside").value)));
    $("play").addEventListener("click", () => play(!playing));
    $("previous").addEventListener("click", () => neighbour(-1));
    $("next").addEventListener("click", () => neighbour(1));
    $("scrub").addEventListener("input", () => { play(false); seek(Number($("scrub").value)); });
    $("player").addEventListener("keydown", keys);
    for (const box of document.querySelectorAll(".layers input")) box.addEventListener("change", render);
    const pick = (event) => { if (toTime) { play(false); seek(toTime(event.offsetX)); } };
    $("clearance").addEventListener("pointerdown", (event) => { $("clearance").setPointerCapture(event.pointerId); pick(event); });
    $("clearance").addEventListener("pointermove", (event) => { if (event.buttons) pick(event); });
    new ResizeObserver(render).observe($("stage"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", render);
    window.addEventListener("hashchange", fromAddress);
    document.addEventListener("click", (event) => {  // a link to the address that is in the bar already changes no hash
      const link = event.target.closest && event.target.closest('a[href^="#replay-"]');
      if (link && link.getAttribute("href") === location.hash) fromAddress();
    });
    if (!fromAddress() && meta.first !== null) show(meta.first);
  }

  start();
  return { show, seek, state: () => ({ time, playing, now: trial && at(trial, time), trial: trial && trial.index, beside: beside && beside.index, fellows: fellows.map((f) => f.index) }) };
})();
