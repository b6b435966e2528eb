"use strict";
// What a reader may do with a report: zoom plots, hide traces, sort tables. Without it the page is whole all the same.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const make = (name, attributes, parent, space) => {
    const element = space ? document.createElementNS(space, name) : document.createElement(name);
    for (const key in attributes) element.setAttribute(key, attributes[key]);
    if (parent) parent.appendChild(element);
    return element;
  };
  const button = (text, label, parent, act) => {
    const made = make("button", { type: "button", "aria-label": label, title: label }, parent);
    made.textContent = text;
    made.addEventListener("click", act);
    return made;
  };

  // ---- Zoom. One object an axes: `whole` and `view` are [x0, x1, y0, y1] in data, `box` is its place in the drawing.
  const axesOf = (group) => {
    const whole = group.dataset.box.split(" ").map(Number);
    const patch = group.querySelector("path").getBBox();
    const axes = { group, whole, view: whole.slice(), link: group.dataset.link, box: patch, moved: [], drawn: [] };
    for (const clipped of [...group.querySelectorAll("[clip-path]")]) {
      if (clipped.closest(".tick")) continue;
      const outer = make("g", { "clip-path": clipped.getAttribute("clip-path") }, null, SVG);
      clipped.replaceWith(outer);
      outer.appendChild(clipped);
      clipped.removeAttribute("clip-path");
      // Marks and words keep their size: they move.
      const marks = [...clipped.querySelectorAll("use, text")].map((one) => [one, +one.getAttribute("x"), +one.getAttribute("y")]);
      if (!marks.length) clipped.setAttribute("vector-effect", "non-scaling-stroke");
      axes.moved.push({ element: clipped, marks });
    }
    axes.ticks = { x: [...group.querySelectorAll(".tick.x")], y: [...group.querySelectorAll(".tick.y")] };
    return axes;
  };

  const place = (axes, which, value) => {
    const [low, high] = which === "x" ? axes.view : axes.view.slice(2);
    const part = (value - low) / (high - low);
    return which === "x" ? axes.box.x + part * axes.box.width : axes.box.y + (1 - part) * axes.box.height;
  };

  const steps = (low, high, most) => {
    const rough = (high - low) / most;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    return found.map((value) => [value, value.toFixed(Math.min(digits, 12)).replace("-", "\u2212")]);
  };

  const draw = (axes) => {
    const { whole, view, box } = axes;
    const sx = (whole[1] - whole[0]) / (view[1] - view[0]), sy = (whole[3] - whole[2]) / (view[3] - view[2]);
    const tx = box.x - sx * (box.x + ((view[0] - whole[0]) / (whole[1] - whole[0])) * box.width);
    const ty = box.y - sy * (box.y + ((whole[3] - view[3]) / (whole[3] - whole[2])) * box.height);
    for (const { element, marks } of axes.moved) {
      if (!marks.length) element.setAttribute("transform", `matrix(${sx} 0 0 ${sy} ${tx} ${ty})`);
      for (const [mark, x, y] of marks) {
        mark.setAttribute("x", sx * x + tx);
        mark.setAttribute("y", sy * y + ty);
      }
    }
    for (const old of axes.drawn) old.remove();
    axes.drawn = [];
    const asDrawn = whole.every((value, k) => value === view[k]);
    for (const which of ["x", "y"]) {
      for (const tick of axes.ticks[which]) tick.style.display = asDrawn ? "" : "none";
      if (asDrawn) continue;
      const labelled = axes.ticks[which].some((tick) => tick.querySelector("text"));
      const [low, high] = which === "x" ? view : view.slice(2);
      for (const [value, text] of steps(low, high, which === "x" ? 6 : 4)) {
        const at = place(axes, which, value);
        const ends = which === "x"
          ? { x1: at, x2: at, y1: box.y, y2: box.y + box.height } : { x1: box.x, x2: box.x + box.width, y1: at, y2: at };
        const line = make("line", { ...ends, class: "own-grid" }, null, SVG);
        axes.group.insertBefore(line, axes.group.children[1] || null);
        axes.drawn.push(line);
        if (!labelled) continue;
        const spot = which === "x"
          ? { x: at, y: box.y + box.height + 12, "text-anchor": "middle" } : { x: box.x - 5, y: at + 3, "text-anchor": "end" };
        const label = make("text", { ...spot, class: "own-tick" }, axes.group, SVG);
        label.textContent = text;
        axes.drawn.push(label);
      }
    }
  };

  const show = (all, axes, view) => {
    for (const other of axes.link ? all.filter((one) => one.link === axes.link) : [axes]) {
      other.view = other === axes ? view : [view[0], view[1], other.view[2], other.view[3]];
      draw(other);
    }
  };

  const by = (all, factor) => {
    const done = new Set();
    for (const axes of all) {
      if (axes.link && done.has(axes.link)) continue;
      done.add(axes.link);
      const [x0, x1, y0, y1] = axes.view;
      const x = (x0 + x1) / 2, y = (y0 + y1) / 2, half = (factor * (x1 - x0)) / 2, up = (factor * (y1 - y0)) / 2;
      const wide = [x - half, x + half, ...(axes.link ? [y0, y1] : [y - up, y + up])];
      const inside = wide.map((value, k) => (k % 2 ? Math.min : Math.max)(value, axes.whole[k]));
      show(all, axes, inside);
    }
  };

  const reset = (all) => { for (const axes of all) { axes.view = axes.whole.slice(); draw(axes); } };

  const dragging = (plot, all) => {
    let began = null, frame = null;
    const at = (event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.getScreenCTM().inverse());
    const value = (axes, point) => [
      axes.view[0] + ((point.x - axes.box.x) / axes.box.width) * (axes.view[1] - axes.view[0]),
      axes.view[3] - ((point.y - axes.box.y) / axes.box.height) * (axes.view[3] - axes.view[2]),
    ];
    plot.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch" || event.button) return;
      const from = at(event);
      const axes = all.find(({ box }) =>
        from.x >= box.x && from.x <= box.x + box.width && from.y >= box.y && from.y <= box.y + box.height);
      if (!axes) return;
      event.preventDefault();
      began = { axes, from };
      frame = make("rect", { class: "own-frame" }, plot, SVG);
    });
    window.addEventListener("pointermove", (event) => {
      if (!began) return;
      const { axes, from } = began, to = at(event), { box } = axes;
      const clamp = (number, low, size) => Math.min(Math.max(number, low), low + size);
      const x = [from.x, clamp(to.x, box.x, box.width)].sort((a, b) => a - b);
      const y = axes.link ? [box.y, box.y + box.height] : [from.y, clamp(to.y, box.y, box.height)].sort((a, b) => a - b);
      const place = { x: x[0], y: y[0], width: x[1] - x[0], height: y[1] - y[0] };
      for (const key in place) frame.setAttribute(key, place[key]);
      began.seen = [x, y];
    });
    window.addEventListener("pointerup", () => {
      if (!began) return;
      const { axes, seen } = began;
      frame.remove();
      began = null;
      if (!seen || seen[0][1] - seen[0][0] < 4) return;
      const [x0, top] = value(axes, { x: seen[0][0], y: seen[1][0] }), [x1, bottom] = value(axes, { x: seen[0][1], y: seen[1][1] });
      show(all, axes, [x0, x1, ...(axes.link ? axes.view.slice(2) : [bottom, top])]);
    });
    plot.addEventListener("dblclick", () => reset(all));
  };

  const plots = [];
  for (const figure of document.querySelectorAll("figure")) {
    const plot = figure.querySelector("svg.plot");
    const all = plot ? [...plot.querySelectorAll("[data-box]")].map(axesOf) : [];
    const traces = plot ? [...new Set([...plot.querySelectorAll("[data-trace]")].map((line) => line.dataset.trace))] : [];
    if (!all.length) continue;
    const tools = make("div", { class: "tools", role: "group", "aria-label": "Plot" });
    figure.prepend(tools);
    button("+", "Zoom in", tools, () => by(all, 0.5));
    button("\u2212", "Zoom out", tools, () => by(all, 2));
    button("Whole", "Show the whole plot", tools, () => reset(all));
    for (const trace of traces.length > 1 ? traces : []) {
      const label = make("label", {}, tools);
      const box = make("input", { type: "checkbox", checked: "" }, label);
      label.append(` ${trace}`);
      box.addEventListener("change", () => {
        for (const line of plot.querySelectorAll("[data-trace]"))
          if (line.dataset.trace === trace) line.style.display = box.checked ? "" : "none";
      });
    }
    dragging(plot, all);
    plots.push(all);
  }
  window.addEventListener("beforeprint", () => plots.forEach(reset));

  // ---- Tables: a click on a head sorts by its column, upward, then downward, then as it was.
  const number = (text) => {
    const found = text.replace(/\u2212/g, "-").match(/^[^\w-]*(-?\d+(?:\.\d+)?(?:e[-+]?\d+)?)/i);
    return found ? Number(found[1]) : null;
  };
  const compare = (a, b) => {
    const x = number(a), y = number(b);
    if (!a || !b) return a ? -1 : b ? 1 : 0;
    if (x !== null && y !== null) return x - y;
    return x !== null ? -1 : y !== null ? 1 : a.localeCompare(b);
  };
  for (const table of document.querySelectorAll("table")) {
    const body = table.tBodies[0], rows = body ? [...body.rows] : [];
    if (rows.length < 2) continue;
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const sorter = make("button", { type: "button", class: "sort" });
      sorter.append(...head.childNodes);
      head.append(sorter);
      sorter.addEventListener("click", () => {
        const next = { none: "ascending", ascending: "descending", descending: "none" }[head.getAttribute("aria-sort") || "none"];
        for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
        if (next !== "none") head.setAttribute("aria-sort", next);
        const text = (row) => row.cells[column].textContent.trim();
        const order = rows.slice();
        if (next !== "none") order.sort((a, b) => (next === "ascending" ? 1 : -1) * compare(text(a), text(b)));
        body.append(...order);
        table.classList.toggle("sorted", next !== "none");
      });
    });
    // ---- The table as a file, in the order that is shown.
    const name = (table.parentNode.getAttribute("aria-label") || "table").replace(/[^\p{L}\p{N}]+/gu, "_");
    const cell = (one) => `"${one.textContent.trim().replace(/\s+/g, " ").replaceAll('"', '""')}"`;
    const save = make("button", { type: "button", class: "save" });
    save.textContent = "Save as CSV";
    save.addEventListener("click", () => {
      const lines = [table.tHead.rows[0], ...table.tBodies[0].rows].map((row) => [...row.cells].map(cell).join(","));
      const file = new Blob(["\ufeff", lines.join("\r\n"), "\r\n"], { type: "text/csv" });
      const link = make("a", { href: URL.createObjectURL(file), download: `${name}.csv` });
      link.click();
      URL.revokeObjectURL(link.href);
    });
    table.after(save);
  }
})();
