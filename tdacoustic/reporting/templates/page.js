"use strict";
(() => {
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];

  /* ---- tables: sorting and download ---- */
  const value = (cell) => (cell.dataset.v !== undefined ? cell.dataset.v : cell.textContent.trim());
  const sortable = (cell) => (cell.dataset.s !== undefined ? cell.dataset.s : value(cell));
  const wording = (cell) => (cell.dataset.t !== undefined ? cell.dataset.t : cell.textContent.trim());
  const collator = new Intl.Collator("en", { numeric: true });

  const sortBy = (table, column, direction) => {
    const body = table.tBodies[0];
    const head = table.tHead.rows[0].cells[column];
    const numeric = head.dataset.kind === "number";
    const key = (row) => {
      const text = sortable(row.cells[column]);
      return numeric ? (text === "" ? null : Number(text)) : text || null;
    };
    const rows = [...table.rowsAtFirst];
    if (direction !== "none") {
      const sign = direction === "ascending" ? 1 : -1;
      rows.sort((a, b) => {
        const p = key(a), q = key(b);
        if (p === null || q === null) return (p === null) - (q === null);
        return sign * (numeric ? p - q : collator.compare(p, q));
      });
    }
    for (const cell of table.tHead.rows[0].cells) cell.removeAttribute("aria-sort");
    if (direction !== "none") head.setAttribute("aria-sort", direction);
    body.append(...rows);
  };

  const quoted = (text) => (/[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const save = (blob, name) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  };

  for (const figure of all("figure.table")) {
    const table = figure.querySelector("table");
    table.rowsAtFirst = [...table.tBodies[0].rows];
    all("thead th", table).forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.className = "head";
      const words = head.querySelector(".words");
      button.textContent = words.textContent;
      button.title = document.body.dataset.sort;
      words.classList.add("on-paper");
      words.before(button);
      button.addEventListener("click", () => {
        const next = { ascending: "descending", descending: "none" }[head.getAttribute("aria-sort")] || "ascending";
        sortBy(table, column, next);
      });
    });
    const download = figure.querySelector(".csv");
    download.hidden = false;
    download.addEventListener("click", () => {
      // a number that is shown in words has both: the number under the column's key, the words in a column beside it
      const heads = all("thead th", table), worded = heads.map((cell) => cell.dataset.worded !== undefined);
      const lines = [heads.flatMap(({ dataset: { key } }, at) => (worded[at] ? [key, `${key}_text`] : [key]))];
      for (const row of table.tBodies[0].rows) {
        lines.push([...row.cells].flatMap((cell, at) => (worded[at] ? [value(cell), wording(cell)] : [value(cell)])));
      }
      const text = lines.map((line) => line.map(quoted).join(",") + "\n").join("");
      save(new Blob([text], { type: "text/csv;charset=utf-8" }), download.dataset.file);
    });
  }

  /* ---- alternatives: one channel or condition at a time ---- */
  for (const [number, group] of all(".alternatives").entries()) {
    const views = [...group.children].filter((one) => one.classList.contains("view"));
    const chooser = document.createElement("select");
    chooser.id = `chooser-${number + 1}`;
    views.forEach((view, at) => chooser.append(new Option(view.dataset.name, at)));
    const show = () => views.forEach((view, at) => { view.hidden = at !== chooser.selectedIndex; });
    const bar = document.createElement("p"), label = document.createElement("label");
    bar.className = "chooser";
    label.htmlFor = chooser.id;
    label.textContent = group.dataset.label;
    bar.append(label, chooser);
    group.prepend(bar);
    group.classList.add("chosen");
    chooser.addEventListener("change", show);
    group.reveal = (inside) => {
      const at = views.findIndex((view) => view.contains(inside));
      if (at >= 0) { chooser.selectedIndex = at; show(); }
    };
    show();
  }

  /* ---- a link to something folded away or not chosen opens it ---- */
  const reveal = () => {
    const target = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    for (let node = target; node; node = node.parentElement) {
      if (node.tagName === "DETAILS") node.open = true;
      if (node.reveal) node.reveal(target);
    }
    target.scrollIntoView();
  };
  addEventListener("hashchange", reveal);
  reveal();

  /* ---- sounds: one at a time; changing between those of one place keeps the place ---- */
  const players = all(".sound audio");
  for (const block of all(".sound")) {
    const own = all("audio", block), strip = block.querySelector(".strip"), cursor = block.querySelector(".cursor");
    let last = null;
    const draw = () => {
      if (!last || !cursor) return;
      cursor.hidden = false;
      cursor.style.left = `${(100 * last.currentTime) / (last.duration || 1)}%`;
      if (!last.paused) requestAnimationFrame(draw);
    };
    for (const audio of own) {
      audio.addEventListener("play", () => {
        for (const other of players) if (other !== audio) other.pause();
        if (last && last !== audio && !last.ended) audio.currentTime = last.currentTime;
        last = audio;
        audio.closest(".track").classList.add("playing");
        draw();
      });
      audio.addEventListener("pause", () => audio.closest(".track").classList.remove("playing"));
      audio.addEventListener("seeked", () => {
        if (!last || last.paused) last = audio;
        draw();
      });
    }
    if (!strip) continue;
    strip.addEventListener("click", (event) => {
      const box = strip.getBoundingClientRect(), audio = last || own[0];
      audio.currentTime = ((event.clientX - box.left) / box.width) * (audio.duration || 0);
    });
  }

  /* ---- contents: where the reader is ---- */
  const links = new Map(all("nav.side a").map((link) => [link.getAttribute("href").slice(1), link]));
  if (links.size && "IntersectionObserver" in window) {
    const sections = all("main section[id]").filter((section) => links.has(section.id));
    const mark = () => {
      let here = sections[0];
      for (const section of sections) if (section.getBoundingClientRect().top < 140) here = section;
      links.forEach((link, id) => link.classList.toggle("here", here && id === here.id));
    };
    let waiting = false;
    addEventListener("scroll", () => {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => { waiting = false; mark(); });
    }, { passive: true });
    mark();
  }

  /* ---- print: everything open ---- */
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = all("details:not([open]):not(.narrow)");
    opened.forEach((details) => { details.open = true; });
  });
  addEventListener("afterprint", () => opened.forEach((details) => { details.open = false; }));

  /* ---- figures ---- */
  const packed = document.getElementById("plotly");
  if (!packed || !("DecompressionStream" in window) || !("IntersectionObserver" in window)) return;
  const palette = JSON.parse(document.getElementById("palette").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const touch = matchMedia("(pointer: coarse)");

  const AXES = ["xaxis", "yaxis"];

  let library = null;
  const plotly = () => {
    library = library || (async () => {
      const bytes = Uint8Array.from(atob(packed.textContent.trim()), (c) => c.charCodeAt(0));
      const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
      const script = document.createElement("script");
      script.textContent = await new Response(stream).text();
      document.head.append(script);
      packed.remove();
      if (!window.Plotly) throw new Error("plotly did not start");
      return window.Plotly;
    })();
    return library;
  };

  const coloured = (node, colours) => {
    if (typeof node === "string") return node.startsWith("var(--") ? colours[node.slice(6, -1)] : node;
    if (Array.isArray(node)) return typeof node[0] === "number" ? node : node.map((one) => coloured(one, colours));
    if (node && typeof node === "object") {
      return Object.fromEntries(Object.entries(node).map(([key, one]) => [key, coloured(one, colours)]));
    }
    return node;
  };
  const painted = (figure, scheme) => {  // plotly writes into the layout that it is given: a copy
    const { data, layout } = figure.json;
    return coloured({ data, layout: structuredClone(layout) }, palette[scheme]);
  };

  /* The same greedy placement as layout.py, for the size and the range shown. */
  const measure = document.createElement("canvas").getContext("2d");
  measure.font = `11px ${getComputedStyle(document.body).fontFamily}`;
  const decoder = document.createElement("textarea");
  const plain = (text) => { decoder.innerHTML = text; return decoder.value; };

  const annotations = (labels, x, y, colours) => {
    const width = x._length, height = y._length, line = 15, boxes = [], placed = [];
    const at = (one) => [
      ((one.x - x.range[0]) / (x.range[1] - x.range[0])) * width,
      one.y === null ? 0 : ((y.range[1] - one.y) / (y.range[1] - y.range[0])) * height,
    ];
    const shown = labels.map((one) => ({ one, at: at(one) }))
      .filter(({ at: [px, py] }) => px >= -1 && px <= width + 1 && py >= -1 && py <= height + 1);
    const rank = ({ one, at: [px, py] }) => (one.y === null ? [0, px] : [1, py]);
    shown.sort((a, b) => rank(a)[0] - rank(b)[0] || rank(a)[1] - rank(b)[1]);
    const points = shown.filter(({ one }) => one.y !== null);
    const free = (box, own) => boxes.every((b) => box[2] <= b[0] || box[0] >= b[2] || box[3] <= b[1] || box[1] >= b[3])
      && points.every(({ one, at: [px, py] }) => one === own
        || px <= box[0] - 3 || px >= box[2] + 3 || py <= box[1] - 3 || py >= box[3] + 3);
    for (const { one, at: [px, py] } of shown) {
      const rule = one.y === null, size = measure.measureText(plain(one.text)).width + 8;
      const over = rule
        ? (px + 3 + size <= width ? px + 3 + size / 2 : px - 3 - size / 2)
        : Math.min(Math.max(px, size / 2), width - size / 2);
      const places = [0, 1, 2, 3, 4].map((level) => [over, rule ? 3 + line * (level + 0.5) : py - line * (level + 0.95)]);
      if (!rule) places.push([px + size / 2 + 7.5, py], [px - size / 2 - 7.5, py]);
      for (const [level, [centre, middle]] of places.entries()) {
        const box = [centre - size / 2, middle - line / 2, centre + size / 2, middle + line / 2];
        if (box[1] < 0 || box[0] < -1 || box[2] > width + 1 || !free(box, one)) continue;
        boxes.push(box);
        const common = { x: one.x, text: one.text, font: { size: 11, color: coloured(one.color, colours) }, bgcolor: colours.label };
        placed.push(rule
          ? { ...common, yref: "paper", y: 1, yanchor: "middle", showarrow: false, xshift: centre - px, yshift: -middle }
          : {
            ...common, y: one.y, showarrow: true, ax: centre - px, ay: middle - py, arrowhead: 0, arrowwidth: 0.8,
            arrowcolor: level > 0 && level < 5 ? coloured(one.color, colours) : "rgba(0,0,0,0)", standoff: 5, borderpad: 1,
          });
        break;
      }
    }
    return placed;
  };

  const tickText = (v) => {
    if (v >= 1e6 || v < 1e-4) return v.toExponential(0).replace("e+", "e");
    return v >= 1e4 ? v.toFixed(0).replace(/\B(?=(\d{3})+$)/g, "\u202f") : String(Number(v.toPrecision(6)));
  };
  const ticks = (axis) => {
    if (axis.type !== "log") return {};
    const [low, high] = axis.range, values = [];
    const digits = high - low <= 4 ? [1, 2, 5] : [1];
    for (let power = Math.floor(low); power <= Math.ceil(high); power += 1) {
      for (const digit of digits) {
        const at = power + Math.log10(digit);
        if (at >= low - 1e-6 && at <= high + 1e-6) values.push(Number(`${digit}e${power}`));
      }
    }
    if (values.length < 3) return { tickmode: "auto", tickvals: null, ticktext: null };
    const room = axis._id === "x" ? 42 : 18;
    const thin = values.length * room > axis._length && digits.length > 1;
    const kept = thin ? values.filter((v) => /^1e/.test(v.toExponential())) : values;
    return kept.length < 2
      ? { tickmode: "auto", tickvals: null, ticktext: null }
      : { tickmode: "array", tickvals: kept, ticktext: kept.map(tickText) };
  };

  const settle = async (figure) => {
    const Plotly = await plotly(), full = figure.live._fullLayout, change = {};
    const colours = palette[dark.matches ? "dark" : "light"];
    const labels = (figure.json.layout.meta || {}).labels || [];
    if (labels.length) change.annotations = annotations(labels, full.xaxis, full.yaxis, colours);
    for (const name of AXES) {
      for (const [key, one] of Object.entries(ticks(full[name]))) change[`${name}.${key}`] = one;
    }
    if (!Object.keys(change).length) return;
    figure.busy = true;
    await Plotly.relayout(figure.live, change);
    figure.busy = false;
  };

  const layoutFor = (figure, scheme) => {
    const { data, layout } = painted(figure, scheme);
    if (touch.matches) layout.dragmode = false;
    if (figure.live._fullLayout) {
      for (const name of AXES) layout[name].range = [...figure.live._fullLayout[name].range];
    }
    return { data, layout };
  };

  const config = { displayModeBar: false, displaylogo: false, doubleClick: "reset", showTips: false, responsive: false };

  const reset = async (figure) => {
    const { xaxis, yaxis } = figure.json.layout;
    await (await plotly()).relayout(figure.live, { "xaxis.range": [...xaxis.range], "yaxis.range": [...yaxis.range] });
  };

  /* Keys of a figure: + and - zoom about its centre, arrows move by a tenth, 0 and Escape go back. */
  const ZOOMS = { "+": 0.8, "=": 0.8, "-": 1.25, _: 1.25 };
  const MOVES = { ArrowLeft: ["xaxis", -0.1], ArrowRight: ["xaxis", 0.1], ArrowDown: ["yaxis", -0.1], ArrowUp: ["yaxis", 0.1] };
  const stretch = ([low, high], [first, last], zoom, shift) => {  // within the whole of the figure
    const of = (v) => (v - first) / (last - first), back = (part) => first + part * (last - first);
    const span = Math.min((of(high) - of(low)) * zoom, 1);
    const start = Math.min(Math.max((of(low) + of(high) - span) / 2 + shift * span, 0), 1 - span);
    return [back(start), back(start + span)];
  };
  const steer = async (figure, event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target !== figure.live) return;
    const zoom = ZOOMS[event.key], [moved, by] = MOVES[event.key] || [];
    const back = event.key === "0" || event.key === "Escape";
    if (!zoom && !moved && !back) return;
    event.preventDefault();
    if (back) { await reset(figure); return; }
    const full = figure.live._fullLayout, change = {};
    for (const name of AXES) {
      if (moved && name !== moved) continue;
      change[`${name}.range`] = stretch(full[name].range, figure.json.layout[name].range, zoom || 1, by || 0);
    }
    await (await plotly()).relayout(figure.live, change);
  };

  const draw = async (figure) => {
    const Plotly = await plotly();
    figure.live = document.createElement("div");
    figure.live.className = "live-plot";
    figure.live.setAttribute("role", "img");
    figure.live.setAttribute("aria-label", figure.plot.querySelector("img").alt);
    figure.live.setAttribute("aria-description", document.body.dataset.keys);
    figure.live.tabIndex = 0;
    figure.live.addEventListener("keydown", (event) => steer(figure, event));
    figure.plot.append(figure.live);
    figure.node.classList.add("live");
    const { data, layout } = layoutFor(figure, dark.matches ? "dark" : "light");
    await Plotly.newPlot(figure.live, data, layout, config);
    await settle(figure);
    figure.live.on("plotly_relayout", () => { if (!figure.busy) settle(figure); });
    let width = figure.live.clientWidth, timer = 0;
    new ResizeObserver(() => {
      if (!figure.live.clientWidth || Math.abs(figure.live.clientWidth - width) < 2) return;
      width = figure.live.clientWidth;
      clearTimeout(timer);
      timer = setTimeout(async () => {
        figure.busy = true;
        await Plotly.relayout(figure.live, { width });
        figure.busy = false;
        settle(figure);
      }, 120);
    }).observe(figure.plot);
  };

  const picture = async (figure) => {
    const Plotly = await plotly(), full = figure.live._fullLayout;
    const { data, layout } = layoutFor(figure, "light");
    const labels = (layout.meta || {}).labels || [];
    layout.annotations = annotations(labels, full.xaxis, full.yaxis, palette.light);
    for (const name of AXES) Object.assign(layout[name], ticks(full[name]));
    const origin = figure.node.dataset.origin ? ` (${figure.node.dataset.origin})` : "";
    const title = (figure.node.dataset.title + origin).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
    layout.title = { text: title, x: 0.01, xanchor: "left", y: 1, yanchor: "top", yref: "container", pad: { t: 12 }, font: { size: 15 } };
    layout.margin = { ...layout.margin, t: full._size.t + 34 };  // above a legend of any number of rows
    const size = { width: figure.live.clientWidth, height: layout.height + 34 };
    layout.height = size.height;
    layout.width = size.width;
    await Plotly.downloadImage({ data, layout, config }, { format: "png", filename: figure.node.dataset.name, scale: 3, ...size });
  };

  const figures = new Map();
  for (const node of all("figure.figure")) {
    const json = node.querySelector('script[type="application/json"]');
    if (!json) continue;
    const figure = { node, plot: node.querySelector(".plot"), live: null, busy: false };
    Object.defineProperty(figure, "json", {
      configurable: true,
      get() {
        const parsed = JSON.parse(json.textContent);
        Object.defineProperty(figure, "json", { value: parsed });
        return parsed;
      },
    });
    const tools = node.querySelector(".tools");
    tools.hidden = false;
    tools.querySelector(".reset").addEventListener("click", () => reset(figure));
    tools.querySelector(".png").addEventListener("click", () => picture(figure));
    figures.set(node, figure);
  }

  const fallBack = (error) => {
    console.error(error);
    figures.forEach(({ node, live }) => { node.classList.remove("live"); if (live) live.remove(); });
    all(".figure .tools").forEach((tools) => { tools.hidden = true; });
  };

  const watcher = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      if (!isIntersecting) continue;
      watcher.unobserve(target);
      draw(figures.get(target)).catch(fallBack);
    }
  }, { rootMargin: "500px 0px" });
  figures.forEach((_, node) => watcher.observe(node));

  dark.addEventListener("change", async () => {
    const Plotly = await plotly();
    for (const figure of figures.values()) {
      if (!figure.live) continue;
      const { data, layout } = layoutFor(figure, dark.matches ? "dark" : "light");
      figure.busy = true;
      await Plotly.react(figure.live, data, layout, config);
      figure.busy = false;
      await settle(figure);
    }
  });
})();
