// Draws every figure.plot of the page from the JSON beside it.
(() => {
  "use strict";
  const colour = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const isMissing = value => value === null || value === undefined;
  const written = value => {
    if (isMissing(value) || !isFinite(value)) return "";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-4 || size >= 1e7)) return value.toExponential(3);
    return String(Number(value.toPrecision(5)));
  };

  // One column of x for all curves. Rows a curve has no sample at are `undefined`, which uPlot draws through;
  // holes of the data itself are `null`, which it does not.
  function aligned(series) {
    const columns = [];
    for (const curve of series) {
      columns.push({ x: curve.x, y: curve.y, at: 0 });
      if (curve.kind === "band") columns.push({ x: curve.x, y: curve.upper, at: 0 });
    }
    const data = [[], ...columns.map(() => [])];
    for (;;) {
      let next = Infinity;
      for (const column of columns) if (column.at < column.x.length) next = Math.min(next, column.x[column.at]);
      if (next === Infinity) return data;
      data[0].push(next);
      columns.forEach((column, index) => {
        const hit = column.at < column.x.length && column.x[column.at] === next;
        data[index + 1].push(hit ? column.y[column.at++] : undefined);
      });
    }
  }

  const groups = new Map();
  const plots = [];

  // As the curve is drawn: two of one colour differ by their dashes.
  function marker(self, index) {
    const { _stroke, stroke, dash } = self.series[index];
    const ink = _stroke || stroke();
    return dash ? `repeating-linear-gradient(90deg, ${ink} 0 .3em, transparent .3em .4em)` : ink;
  }

  function curveOptions(spec) {
    const options = [{ label: spec.x.label, value: (_, value) => written(value) }];
    const bands = [];
    const partner = new Map();
    let free = 0;
    for (const curve of spec.series) {
      const stroke = colour(curve.tone === "next" ? "next-" + (free++ % 8) : curve.tone);
      const common = {
        label: curve.name, stroke, width: curve.tone === "quiet" ? 1.2 : 1.5,
        dash: curve.dashed ? [6, 4] : undefined, value: (_, value) => written(value),
        points: { show: false },
      };
      if (curve.kind === "points") {
        options.push({ ...common, paths: () => null, points: { show: true, size: 4, width: 0, fill: stroke } });
      } else if (curve.kind === "steps") {
        options.push({ ...common, paths: uPlot.paths.stepped({ align: 1 }) });
      } else if (curve.kind === "band") {
        const lower = options.length;
        const edge = { ...common, stroke: stroke + "66", width: 0.6, fill: undefined };
        const upper = (u, value, index, row) =>
          isMissing(value) ? "" : written(value) + " to " + written(u.data[lower + 1][row]);
        options.push({ ...edge, value: upper }, { ...edge, label: curve.name + " (upper)" });
        bands.push({ series: [lower + 1, lower], fill: stroke + "2e" });
        partner.set(lower, lower + 1);
      } else {
        options.push(common);
      }
    }
    return { options, bands, partner };
  }

  // uPlot's own ticks of a logarithmic axis never end where the axis does not begin at a round number.
  function logarithmicTicks(_, index, low, high) {
    if (!(low > 0 && high > low && isFinite(high))) return [low];
    const ticks = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
      for (let digit = 1; digit < 10; digit++) {
        const tick = Number(digit + "e" + power);
        if (tick >= low && tick <= high) ticks.push(tick);
      }
    }
    if (ticks.length > 2) return ticks;
    // Zoomed in between two of them: even steps.
    const rough = (high - low) / 5;
    const unit = 10 ** Math.floor(Math.log10(rough));
    const step = unit * [1, 2, 5, 10].find(factor => factor * unit >= rough);
    const even = [];
    for (let count = Math.ceil(low / step); count * step <= high && even.length < 20; count++) {
      even.push(Number((count * step).toPrecision(12)));
    }
    return even;
  }

  // Which of them carry a number: all where they are few, else those that begin with 1, 2, 5, or with 1.
  function logarithmicLabels(_, ticks) {
    const first = tick => tick.toExponential()[0];
    const shown = ticks.length <= 6 ? "123456789" : ticks.length <= 20 ? "125" : "1";
    return ticks.map(tick => (shown.includes(first(tick)) ? tick : null));
  }

  function axis(spec, side) {
    const ink = colour("soft");
    const grid = { stroke: colour("line"), width: 1 };
    return {
      label: spec.label, stroke: ink, grid, ticks: { ...grid, size: 5 }, side,
      font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", labelGap: 2,
      size: side === 3 ? 66 : 42, labelSize: 22,
      ...(spec.log ? { splits: logarithmicTicks, filter: logarithmicLabels } : {}),
      values: (_, splits) => splits.map(value => (isMissing(value) ? "" : written(value))),
    };
  }

  function scale(spec, margin) {
    const fixed = spec.range && ((u, low, high) => (u.zoomed ? [low, high] : spec.range));
    if (!spec.log) return { time: false, range: fixed };
    // Without this uPlot rounds a logarithmic axis out to whole decades.
    const tight = (u, low, high) => (isMissing(low) ? [0.1, 10] : u.zoomed ? [low, high] : [low / margin, high * margin]);
    return { time: false, distr: 3, log: 10, range: fixed || tight };
  }

  function drawMarks(u, spec) {
    const { ctx, bbox } = u;
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.font = 11.5 * ratio + "px system-ui, sans-serif";
    const labelled = (text, x, y, align) => {
      ctx.textAlign = align;
      ctx.lineWidth = 3 * ratio;
      ctx.strokeStyle = colour("paper");
      ctx.setLineDash([]);
      ctx.strokeText(text, x, y);
      ctx.fillStyle = colour("soft");
      ctx.fillText(text, x, y);
    };
    let used = -Infinity;
    let row = 0;
    for (const [label, from, to] of spec.spans) {
      const left = u.valToPos(from, "x", true);
      const width = Math.max(u.valToPos(to, "x", true) - left, 1.5 * ratio);
      // Zoomed away from it, neither the mark nor half of its name stays behind.
      if (left + width < bbox.left || left > bbox.left + bbox.width) continue;
      ctx.fillStyle = colour("warning") + "38";
      ctx.fillRect(left, bbox.top, width, bbox.height);
      const at = Math.max(left, bbox.left);
      row = at < used ? (row + 1) % 3 : 0;
      if (label) labelled(label, at + 3 * ratio, bbox.top + (12 + 14 * row) * ratio, "left");
      used = at + ctx.measureText(label).width + 8 * ratio;
    }
    for (const [label, value] of spec.levels) {
      const y = u.valToPos(value, "y", true);
      ctx.strokeStyle = colour("soft");
      ctx.lineWidth = 1.2 * ratio;
      ctx.setLineDash([5 * ratio, 4 * ratio]);
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
      labelled(label, bbox.left + bbox.width - 4 * ratio, y - 4 * ratio, "right");
    }
    ctx.restore();
  }

  function build(figure) {
    const spec = JSON.parse(figure.querySelector("script").textContent);
    const host = figure.querySelector(".drawing");
    const { options, bands, partner } = curveOptions(spec);
    const group = spec.group ? groups.get(spec.group) || [] : null;
    if (group) groups.set(spec.group, group);
    const whenZoomed = (u, key) => {
      if (key !== "x" || !group || u.following) return;
      const { min, max } = u.scales.x;
      for (const other of group) {
        if (other === u || (other.scales.x.min === min && other.scales.x.max === max)) continue;
        other.following = true;
        other.setScale("x", { min, max });
        // uPlot applies scales in a microtask of its own.
        queueMicrotask(() => { other.following = false; });
      }
    };
    const u = new uPlot({
      width: host.clientWidth || 900, height: spec.height,
      scales: { x: scale(spec.x, 1), y: scale(spec.y, 1.3) },
      axes: [axis(spec.x, 2), axis(spec.y, 3)],
      series: options, bands,
      cursor: {
        drag: { x: true, y: true, uni: 40 }, hover: { skip: [undefined] },
        sync: spec.group ? { key: spec.group, scales: ["x", null] } : undefined,
        points: { size: 6 },
      },
      legend: { markers: { width: 0, fill: marker } },
      hooks: {
        draw: [self => drawMarks(self, spec)],
        setSelect: [self => { self.zoomed = self.select.width > 0; }],
        setScale: [whenZoomed],
        setSeries: [(self, index, change) => {
          const other = partner.get(index);
          if (other !== undefined && "show" in change) self.setSeries(other, { show: change.show });
        }],
      },
    }, aligned(spec.series), host);
    u.over.addEventListener("dblclick", () => { u.zoomed = false; }, true);
    for (const upper of partner.values()) u.root.querySelectorAll(".u-series")[upper].style.display = "none";
    if (group) group.push(u);
    plots.push({ u, host, spec });
  }

  function buildAll() {
    for (const { u } of plots.splice(0)) u.destroy();
    groups.clear();
    document.querySelectorAll("figure.plot").forEach(build);
  }
  const resize = () => plots.forEach(({ u, host, spec }) => u.setSize({ width: host.clientWidth, height: spec.height }));

  buildAll();
  addEventListener("resize", resize);
  document.querySelectorAll("details").forEach(part => part.addEventListener("toggle", resize));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", buildAll);
  addEventListener("beforeprint", () => { document.documentElement.classList.add("printing"); buildAll(); });
  addEventListener("afterprint", () => { document.documentElement.classList.remove("printing"); buildAll(); });
})();
