// What the robot's lidar would see: rays against the edges and discs of a scene. Nothing but geometry, no noise.
const Lidar = (() => {
  // [[x, y], ...] of a body's outline at a pose [x, y, angle]
  function place(points, at) {
    const c = Math.cos(at[2]), s = Math.sin(at[2]);
    return points.map(([x, y]) => [at[0] + c * x - s * y, at[1] + s * x + c * y]);
  }

  function scene(bodies) {
    const edges = [], discs = [];
    for (const body of bodies) {
      if (body.r !== undefined) discs.push(body.at[0], body.at[1], body.r);
      else {
        const p = place(body.p, body.at);
        for (let i = 0; i < p.length; i++) {
          const q = p[(i + 1) % p.length];
          edges.push(p[i][0], p[i][1], q[0] - p[i][0], q[1] - p[i][1]);
        }
      }
    }
    return { edges: new Float64Array(edges), discs: new Float64Array(discs) };
  }

  function nearest(world, x, y, dx, dy, far) {
    let best = far;
    const e = world.edges, d = world.discs;
    for (let i = 0; i < e.length; i += 4) {
      const cross = dx * e[i + 3] - dy * e[i + 2];
      if (cross === 0) continue;
      const ax = e[i] - x, ay = e[i + 1] - y;
      const t = (ax * e[i + 3] - ay * e[i + 2]) / cross;
      if (t < 0 || t >= best) continue;
      const u = (ax * dy - ay * dx) / cross;
      if (u >= 0 && u <= 1) best = t;
    }
    for (let i = 0; i < d.length; i += 3) {
      const ax = d[i] - x, ay = d[i + 1] - y;
      const along = ax * dx + ay * dy;
      const inside = d[i + 2] * d[i + 2] - (ax * ax + ay * ay - along * along);
      if (inside < 0) continue;
      const t = along - Math.sqrt(inside);
      if (t >= 0 && t < best) best = t;
    }
    return best;
  }

  // {origin: [x, y], hits: [[x, y, seen], ...]} for a lidar on a robot at `pose`
  function scan(lidar, pose, worlds) {
    const [x, y] = place([[lidar.mount[0], lidar.mount[1]]], pose)[0];
    const step = lidar.beams > 1 ? (lidar.to - lidar.from) / (lidar.beams - 1) : 0;
    const hits = [];
    for (let i = 0; i < lidar.beams; i++) {
      const a = pose[2] + lidar.mount[2] + lidar.from + i * step;
      const dx = Math.cos(a), dy = Math.sin(a);
      let range = lidar.far;
      for (const world of worlds) range = nearest(world, x, y, dx, dy, range);
      hits.push([x + range * dx, y + range * dy, range < lidar.far && range >= lidar.near]);
    }
    return { origin: [x, y], hits };
  }

  return { place, scene, scan };
})();
