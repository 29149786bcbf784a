// Draws one instant of a trial on a canvas, and over time on another how near it came, how fast it was and how long it thought.
const Stage = (() => {
  const COLOURS = ["ink", "muted", "rule", "paper", "panel", "fixture", "furniture", "obstacle", "robot", "moving", "mark",
    "bad", "scan", "estimate", "plan"];

  function palette() {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue("--" + name).trim() || "#888"]));
  }

  function fit(canvas) {
    const box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(box.width * ratio)), height = Math.max(1, Math.round(box.height * ratio));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    const g = canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, box.width, box.height);
    return { g, width: box.width, height: box.height };
  }

  // Metres to pixels so that `bounds` [x0, y0, x1, y1] fits, y up.
  function view(bounds, width, height) {
    const [x0, y0, x1, y1] = bounds;
    const scale = Math.min(width / Math.max(x1 - x0, 0.1), height / Math.max(y1 - y0, 0.1));
    const left = (width - scale * (x1 - x0)) / 2, top = (height - scale * (y1 - y0)) / 2;
    return { scale, x: (x) => left + (x - x0) * scale, y: (y) => height - top - (y - y0) * scale };
  }

  function trace(g, v, points, close) {
    g.beginPath();
    points.forEach(([x, y], i) => (i ? g.lineTo(v.x(x), v.y(y)) : g.moveTo(v.x(x), v.y(y))));
    if (close) g.closePath();
  }

  // A body at a pose; a cross where its outline, or how it lies, is unknown.
  function body(g, v, shape, at, fill, stroke) {
    if (shape.cross || (shape.p && !Number.isFinite(at[2]))) {
      const x = v.x(at[0]), y = v.y(at[1]);
      g.beginPath();
      for (const [dx, dy] of [[6, 6], [6, -6]]) { g.moveTo(x - dx, y - dy); g.lineTo(x + dx, y + dy); }
      g.strokeStyle = fill || stroke; g.lineWidth = 2; g.stroke();
      return;
    }
    if (shape.r !== undefined) { g.beginPath(); g.arc(v.x(at[0]), v.y(at[1]), Math.max(shape.r * v.scale, 0.5), 0, 7); }
    else trace(g, v, Lidar.place(shape.p, at), true);
    if (fill) { g.fillStyle = fill; g.fill(); }
    if (stroke) { g.strokeStyle = stroke; g.stroke(); }
  }

  // Somebody from above: shoulders across the heading, the head before them; around it the disc that can be touched.
  function person(g, v, shape, at, colour, head) {
    const r = Math.max(shape.r * v.scale, 2);
    g.save();
    g.translate(v.x(at[0]), v.y(at[1]));
    g.strokeStyle = colour; g.lineWidth = 1; g.beginPath(); g.arc(0, 0, r, 0, 7); g.stroke();
    if (Number.isFinite(at[2])) g.rotate(-at[2]);
    g.fillStyle = colour; g.beginPath(); g.ellipse(0, 0, 0.5 * r, 0.95 * r, 0, 0, 7); g.fill();
    g.fillStyle = head; g.beginPath(); g.arc(0.18 * r, 0, 0.4 * r, 0, 7); g.fill();
    g.restore();
  }

  function track(g, v, xs, ys, from, to) {
    g.beginPath();
    let down = false;
    for (let i = from; i <= to; i++) {
      if (Number.isNaN(xs[i]) || Number.isNaN(ys[i])) { down = false; continue; }
      if (down) g.lineTo(v.x(xs[i]), v.y(ys[i])); else g.moveTo(v.x(xs[i]), v.y(ys[i]));
      down = true;
    }
    g.stroke();
  }

  function arrow(g, v, at, length, colour) {
    if (at[2] === null || !Number.isFinite(at[2])) return;
    const tip = [at[0] + length * Math.cos(at[2]), at[1] + length * Math.sin(at[2])];
    g.strokeStyle = colour; g.lineWidth = 2;
    trace(g, v, [[at[0], at[1]], tip]); g.stroke();
  }

  // fellows: the trials of the other robots of its simulation.
  function draw(canvas, trial, now, options, fellows) {
    const c = palette(), { g, width, height } = fit(canvas), v = view(options.bounds, width, height);
    const s = trial.samples, i = now.index, pose = now.pose, thought = trial.thoughtAt(now.t);
    g.lineJoin = g.lineCap = "round";
    if (options.plan && thought && thought.field) field(g, v, c, thought.field);
    for (const b of trial.fixed) {
      const fixture = b.kind === "wall", obstacle = b.kind === "obstacle";
      g.lineWidth = 1;
      body(g, v, b, b.at, obstacle ? c.obstacle : fixture ? c.fixture : c.furniture, obstacle ? c.obstacle : c.fixture);
    }
    for (const [k, leg] of trial.legs.entries()) {
      if (leg.goal[0] === null || leg.goal[1] === null) continue;
      const current = k === s.leg[i];
      g.lineWidth = current ? 1.5 : 1; g.strokeStyle = c.mark; g.setLineDash([4, 4]); g.globalAlpha = current ? 1 : 0.4;
      g.beginPath(); g.arc(v.x(leg.goal[0]), v.y(leg.goal[1]), leg.xy === null ? 4 : leg.xy * v.scale, 0, 7); g.stroke();
      g.setLineDash([]);
      if (leg.yaw !== null) arrow(g, v, leg.goal, Math.max(leg.xy, 0.25), c.mark);
      g.globalAlpha = 1;
    }
    if (trial.recorded && options.path) found(g, v, c, trial);
    if (options.scan && scans(trial)) scan(g, v, c, trial, now);
    if (options.plan) for (const fellow of fellows) { const own = fellow.thoughtAt(now.t); if (own && now.t <= fellow.end) plans(g, v, c, own, 0.35); }
    if (options.plan && thought) thoughts(g, v, c, thought);
    if (options.path) { g.strokeStyle = c.robot; g.lineWidth = 2; track(g, v, s.x, s.y, 0, i); }
    trial.movingObstacles.forEach((obstacle, m) => {
      const at = now.movingObstacles[m];
      g.strokeStyle = c.moving; g.lineWidth = 1.5; g.setLineDash([2, 4]);
      if (options.path) track(g, v, s[`m${m}x`], s[`m${m}y`], 0, i);
      g.setLineDash([]);
      if (at && obstacle.person) person(g, v, obstacle, at, c.moving, c.ink);
      else if (at) { g.globalAlpha = 0.85; body(g, v, obstacle, at, c.moving, c.moving); g.globalAlpha = 1; }
      if (at && obstacle.robot) {
        arrow(g, v, at, 0.3, c.ink);
        g.font = "12px system-ui, sans-serif"; g.textAlign = "center"; g.fillStyle = c.ink;
        g.fillText(obstacle.name, v.x(at[0]), v.y(at[1]) - 0.4 * v.scale);
      }
    });
    if (options.estimate && now.estimate) {
      g.strokeStyle = c.estimate; g.lineWidth = 1.5; g.setLineDash([3, 3]);
      track(g, v, s.ex, s.ey, Math.max(0, i - 100), i);
      if (trial.robot.footprint) body(g, v, trial.robot.footprint, now.estimate, null, c.estimate);
      g.setLineDash([]);
    }
    if (pose) {
      g.lineWidth = 2;
      const shape = trial.robot.footprint || { r: 0.05 };
      g.globalAlpha = 0.35; body(g, v, shape, pose, c.robot, null); g.globalAlpha = 1;
      body(g, v, shape, pose, null, now.contact ? c.bad : c.robot);
      arrow(g, v, pose, 0.3, now.contact ? c.bad : c.robot);
    }
    ruler(g, v, c, height);
  }

  // Where the legs that were found in a recording begin (a ring) and end (a dot).
  function found(g, v, c, trial) {
    const s = trial.samples;
    g.strokeStyle = g.fillStyle = c.robot; g.lineWidth = 1.5;
    for (const [leg, from, to] of trial.spans) {
      for (const [t, end] of [[from, false], [to, true]]) {
        let i = s.t.findIndex((x) => x >= t - 1e-3);
        if (i < 0) i = s.t.length - 1;
        if (!Number.isFinite(s.x[i]) || !Number.isFinite(s.y[i])) continue;
        g.beginPath(); g.arc(v.x(s.x[i]), v.y(s.y[i]), end ? 3 : 5, 0, 7);
        if (end) g.fill(); else g.stroke();
      }
    }
  }

  // Whether a scan can be recomputed; around a recording without walls it would be made up.
  function scans(trial) {
    return Boolean(trial.robot.lidar) && (!trial.recorded || trial.fixed.some((b) => b.kind === "wall"));
  }

  function scan(g, v, c, trial, now) {
    if (!now.pose || !Number.isFinite(now.pose[2])) return;
    const lies = (m, k) => now.movingObstacles[k] && !m.cross && (m.r !== undefined || Number.isFinite(now.movingObstacles[k][2]));
    const movingObstacles = Lidar.scene(trial.movingObstacles.flatMap((m, k) => (lies(m, k) ? [{ ...m, at: now.movingObstacles[k] }] : [])));
    const { origin, hits } = Lidar.scan(trial.robot.lidar, now.pose, [trial.world, movingObstacles]);
    g.fillStyle = c.scan; g.globalAlpha = 0.13;
    trace(g, v, [origin, ...hits], true); g.fill();
    g.globalAlpha = 0.9;
    for (const [x, y, seen] of hits) if (seen) g.fillRect(v.x(x) - 1, v.y(y) - 1, 2, 2);
    g.globalAlpha = 0.6; g.strokeStyle = c.scan; g.lineWidth = 1; g.setLineDash([1, 3]); // to whom it sees
    trial.movingObstacles.forEach((m, k) => {
      const at = now.movingObstacles[k], reach = m.r ?? Math.max(0, ...(m.p || []).map(([x, y]) => Math.hypot(x, y)));
      if (!at || !hits.some(([x, y, seen]) => seen && Math.hypot(x - at[0], y - at[1]) <= reach + 0.01)) return;
      trace(g, v, [origin, at]); g.stroke();
    });
    g.setLineDash([]); g.globalAlpha = 1;
  }

  function plans(g, v, c, thought, alpha) {
    Object.entries(thought.lines).forEach(([name, points]) => {
      const local = name.includes("local") || name.includes("trajectory");
      g.strokeStyle = c.plan; g.lineWidth = local ? 3 : 1.5; g.globalAlpha = alpha * (local ? 1 : 0.8);
      g.setLineDash(local ? [] : [6, 3]);
      trace(g, v, points); g.stroke();
    });
    g.setLineDash([]); g.globalAlpha = 1;
  }

  function thoughts(g, v, c, thought) {
    plans(g, v, c, thought, 0.9);
    g.globalAlpha = 0.6; g.strokeStyle = c.muted; g.lineWidth = 0.7;
    g.beginPath();
    for (const [x0, y0, x1, y1] of thought.tree || []) { g.moveTo(v.x(x0), v.y(y0)); g.lineTo(v.x(x1), v.y(y1)); }
    g.stroke();
    const disc = ([x, y, r]) => { g.beginPath(); g.arc(v.x(x), v.y(y), Math.max(r, 0) * v.scale, 0, 7); };
    Object.keys(thought.circles).sort().forEach((name, k) => {
      g.strokeStyle = [c.moving, c.mark, c.muted][k % 3]; g.lineWidth = 1; g.globalAlpha = 0.8;
      for (const d of thought.circles[name]) { disc(d); g.stroke(); }
    });
    g.fillStyle = c.plan; g.globalAlpha = 0.12;
    for (const d of thought.tube || []) { disc(d); g.fill(); }
    g.globalAlpha = 1;
  }

  // A potential or cost, 0 to 100: the higher, the darker; 0 in the data: unknown.
  function field(g, v, c, f) {
    g.fillStyle = c.plan;
    const side = f.cell * v.scale + 0.5;
    for (let i = 0; i < f.data.length; i++) {
      if (f.data[i] < 2) continue;
      g.globalAlpha = 0.6 * (f.data[i] - 1) / 100;
      g.fillRect(v.x(f.at[0] + (i % f.cols) * f.cell), v.y(f.at[1] + (Math.floor(i / f.cols) + 1) * f.cell), side, side);
    }
    g.globalAlpha = 1;
  }

  function ruler(g, v, c, height) {
    g.strokeStyle = g.fillStyle = c.muted; g.lineWidth = 1.5;
    g.beginPath(); g.moveTo(14, height - 14); g.lineTo(14 + v.scale, height - 14); g.stroke();
    g.font = "12px system-ui, sans-serif"; g.textAlign = "left"; g.fillText("1 m", 14, height - 20);
  }

  const ROWS = [ // [column, name, unit, the most that is shown, whether it is shown below 0 too]
    ["c", "clearance", "m", 3, false], ["v", "speed", "m/s", 100, true], ["w", "yaw rate", "rad/s", 100, true], ["d", "decision", "ms", 1e6, false],
  ];

  // What trials (one, or two to compare) did over time, a plot a quantity, with one cursor; returns pixel -> time for clicks.
  function chart(canvas, trials, time, end) {
    const rows = ROWS.filter(([column]) => trials.some((trial) => trial.samples[column]));
    canvas.style.height = `${28 + 58 * Math.max(rows.length, 1)}px`;
    const c = palette(), { g, width, height } = fit(canvas), first = trials[0];
    const left = 84, right = 10, top = 8, bottom = 20, each = (height - top - bottom) / Math.max(rows.length, 1);
    const px = (t) => left + ((width - left - right) * t) / (end || 1);
    g.font = "12px system-ui, sans-serif"; g.lineWidth = 1;
    for (const [leg, from, to] of first.spans) {
      if (leg % 2 === 0) { g.fillStyle = c.panel; g.fillRect(px(from), top, px(to) - px(from), height - top - bottom); }
      const name = first.legs[leg].name;
      g.fillStyle = c.muted; g.textAlign = "center";
      if (px(to) - px(from) > 12 + g.measureText(name).width) g.fillText(name, (px(from) + px(to)) / 2, height - 5);
    }
    rows.forEach((row, k) => plot(g, c, trials, row, px, top + k * each, top + (k + 1) * each - 8, left, width - right));
    if (!rows.some(([column]) => column === "c")) {
      g.fillStyle = c.muted; g.textAlign = "center";
      g.fillText(first.samples.x.some(Number.isFinite) ? "no clearance: nothing to stay clear of, or footprint unknown" : "not recorded", width / 2, top + each / 2);
    }
    const mark = (t) => g.fillRect(px(t) - 1, top, 2, height - top - bottom);
    g.fillStyle = c.moving;
    for (const trial of trials) for (const [t, kind] of trial.events) if (kind === "possible contact") mark(t);
    g.fillStyle = c.bad;
    for (const trial of trials) for (const [t, kind] of trial.events) if (kind === "contact" || kind === "error") mark(t);
    g.strokeStyle = c.ink; g.lineWidth = 1;
    g.beginPath(); g.moveTo(px(time), top - 4); g.lineTo(px(time), height - bottom); g.stroke();
    return (x) => ((x - left) / (width - left - right)) * end;
  }

  // a number on an axis: two digits, or all before the point
  const short = (value) => (Math.abs(value) < 99.5 ? value.toPrecision(2) : value.toFixed(0));

  function plot(g, c, trials, [column, name, unit, most, signed], px, top, bottom, left, right) {
    let low = 0, high = 0;
    for (const trial of trials) for (const value of trial.samples[column] || []) { if (value > high) high = value; if (signed && value < low) low = value; }
    high = Math.max(Math.min(high, most), low < -0.01 ? 0 : 0.2);
    const py = (value) => bottom - ((bottom - top) * (Math.min(Math.max(value, low), high) - low)) / (high - low);
    g.textAlign = "right"; g.fillStyle = c.muted;
    g.fillText(name, left - 6, (top + bottom) / 2 + 4);
    g.fillText(`${short(high)} ${unit}`, left - 6, top + 9);
    g.fillText(low ? short(low) : "0", left - 6, bottom + 1);
    g.strokeStyle = c.rule; g.lineWidth = 1;
    g.beginPath(); g.moveTo(left, py(0)); g.lineTo(right, py(0)); g.stroke();
    trials.forEach((trial, k) => {
      const { t } = trial.samples, values = trial.samples[column];
      if (!values) return;
      g.strokeStyle = k ? c.plan : c.robot; g.lineWidth = 1.5; g.beginPath();
      let down = false;
      for (let i = 0; i < t.length; i++) {
        if (Number.isNaN(values[i])) { down = false; continue; }
        if (down) g.lineTo(px(t[i]), py(values[i])); else g.moveTo(px(t[i]), py(values[i]));
        down = true;
      }
      g.stroke();
    });
  }

  return { draw, chart, scans, short };
})();
