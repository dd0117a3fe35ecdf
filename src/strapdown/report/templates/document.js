"use strict";
// Makes the page's charts and scenes interactive. The charts are whole without it.
(function () {
  var SVG = "http://www.w3.org/2000/svg";

  function element(name, attributes, parent) {
    var made = document.createElementNS(SVG, name);
    Object.keys(attributes).forEach(function (key) { made.setAttribute(key, attributes[key]); });
    if (parent) { parent.appendChild(made); }
    return made;
  }

  function numbers(text) { return (text.match(/-?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?/gi) || []).map(Number); }

  // ---- Axes. A view is the visible part of an axis, as shares of its drawn length.

  function scale(words) {
    var parts = words.split(" ").map(Number);
    var low = parts[0], high = parts[1], log = parts[2] === 1;
    return {
      log: log,
      unit: Math.pow(10, parts[3]),
      value: function (share) {
        return log ? low * Math.pow(high / low, share) : low + share * (high - low);
      },
      share: function (value) {
        return log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
      }
    };
  }

  function written(value, step) {
    var digits = Math.max(0, Math.min(12, -Math.floor(Math.log10(step) + 1e-9)));
    var text = value.toFixed(digits);
    return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
  }

  function ticks(axis, view, most) {
    var low = axis.value(view[0]), high = axis.value(view[1]), found = [];
    if (axis.log && high / low > 8) {
      var every = Math.ceil(Math.log10(high / low) / most);
      for (var power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += 1) {
        [1, 2, 5].forEach(function (digit) {
          var at = digit * Math.pow(10, power);
          if (at < low || at > high || (digit > 1 && high / low > 100) || power % every) { return; }
          found.push({at: at, text: String(Number(at.toPrecision(3))).replace("-", "−")});
        });
      }
      return found;
    }
    var least = (high - low) / most, ten = Math.pow(10, Math.floor(Math.log10(least)));
    var step = ten * [1, 2, 5, 10].find(function (k) { return k * ten >= least * (1 - 1e-9); });
    for (var k = Math.ceil(low / step - 1e-9); k * step <= high * (1 + 1e-12); k += 1) {
      found.push({at: k * step, text: written(k * step / axis.unit, step / axis.unit)});
    }
    return found;
  }

  function readable(axis, view, share) {
    var value = axis.value(share);
    if (axis.log) { return String(Number(value.toPrecision(4))).replace("-", "−"); }
    return written(value, Math.abs(axis.value(view[1]) - axis.value(view[0])) / 2000);
  }

  // ---- A shape remembers where it was drawn, and is drawn again for another view.

  function shape(node) {
    var kind = node.tagName;
    if (kind === "line") {
      var ends = ["x1", "y1", "x2", "y2"].map(function (key) { return Number(node.getAttribute(key)); });
      return {points: ends, put: function (p) {
        ["x1", "y1", "x2", "y2"].forEach(function (key, k) { node.setAttribute(key, p[k]); });
      }};
    }
    if (kind === "path" && !node.classList.contains("points")) {
      // A curve or an area: its start, and its steps.
      var whole = node.getAttribute("d"), end = whole.slice(-1) === "z" ? "z" : "";
      var steps = numbers(whole), x = 0, y = 0, line = new Array(steps.length);
      for (var j = 0; j + 1 < steps.length; j += 2) {
        x += steps[j]; y += steps[j + 1]; line[j] = x; line[j + 1] = y;
      }
      return {points: line, curve: !end, put: function (p) {
        var text = [];
        for (var k = 0; k < p.length; k += 2) { text.push(p[k].toFixed(2) + "," + p[k + 1].toFixed(2)); }
        node.setAttribute("d", "M" + text.join("L") + end);
      }};
    }
    if (kind === "path") {
      // Symbols keep their shape: only the place of each moves.
      var symbols = node.getAttribute("d").split("M").slice(1).map(function (text) {
        var cut = text.search(/[a-z]/);
        return {start: numbers(text.slice(0, cut)), rest: text.slice(cut)};
      });
      var first = symbols.length ? symbols[0].rest : "";
      var size = first.charAt(0) === "a" ? [0, numbers(first)[0]] : offset(first);
      var flat = [];
      symbols.forEach(function (s) { flat.push(s.start[0] + size[0], s.start[1] + size[1]); });
      return {points: flat, symbols: true, put: function (p) {
        node.setAttribute("d", symbols.map(function (s, k) {
          return "M" + (p[2 * k] - size[0]).toFixed(2) + "," + (p[2 * k + 1] - size[1]).toFixed(2) + s.rest;
        }).join(""));
      }};
    }
    return {points: numbers(node.getAttribute("points") || ""), put: function (p) {
      var text = [];
      for (var k = 0; k < p.length; k += 2) { text.push(p[k].toFixed(2) + "," + p[k + 1].toFixed(2)); }
      node.setAttribute("points", text.join(" "));
    }};
  }

  function offset(steps) {
    // From the first corner of an outline to the middle of its box.
    var d = numbers(steps), x = 0, y = 0, xs = [0], ys = [0];
    for (var k = 0; k + 1 < d.length; k += 2) { x += d[k]; y += d[k + 1]; xs.push(x); ys.push(y); }
    return [(Math.min.apply(null, xs) + Math.max.apply(null, xs)) / 2,
            (Math.min.apply(null, ys) + Math.max.apply(null, ys)) / 2];
  }

  // ---- One instant in every chart over the same time, and on the plan.

  var charts = [];

  function share(source, time) {
    charts.forEach(function (one) {
      if (one.figure !== source && one.figure.dataset.xLabel === source.dataset.xLabel) { one.show(time); }
    });
  }

  function chart(figure) {
    var svg = figure.querySelector(".chart > svg"), tip = figure.querySelector(".tip");
    var hidden = {};
    var panels = Array.prototype.map.call(svg.querySelectorAll("svg[data-x]"), function (node) {
      var after = node.nextElementSibling;
      while (!after.classList.contains("ticks")) { after = after.nextElementSibling; }
      var box = {x: +node.getAttribute("x"), y: +node.getAttribute("y"),
                 w: +node.getAttribute("width"), h: +node.getAttribute("height")};
      return {
        node: node, box: box, group: node.dataset.group, kind: node.dataset.kind,
        x: scale(node.dataset.x), y: scale(node.dataset.y), named: node.dataset.named,
        labels: node.dataset.labels.split("|"), vx: [0, 1], vy: [0, 1],
        ticks: after, names: after.nextElementSibling, grid: node.querySelector(".grid"),
        kept: null, shapes: null
      };
    });
    if (!panels.length) { return; }
    var names = panels[panels.length - 1].labels;

    // Down the page for categories, else up.
    function up(panel, share) { return panel.kind === "categories" ? share : 1 - share; }

    function prepare(panel) {
      if (panel.shapes) { return; }
      panel.kept = {grid: panel.grid.innerHTML, ticks: panel.ticks.innerHTML};
      panel.shapes = [];
      panel.node.querySelectorAll("line,polyline,polygon,path").forEach(function (node) {
        // The pattern of a bar is cut to the bar as it was drawn: it is there at full view alone.
        if (node.closest(".grid") || node.closest("svg") !== panel.node) { return; }
        var made = shape(node), owner = node.closest("[data-line]");
        made.series = owner ? owner.dataset.series : null;
        made.colour = node.getAttribute("stroke") || node.getAttribute("fill");
        made.stamps = node.dataset.stamps ? numbers(node.dataset.stamps) : null;
        made.curve = made.curve || node.tagName === "polyline" || made.symbols === true;
        panel.shapes.push(made);
      });
    }

    function moved(panel, points) {
      var b = panel.box, out = new Array(points.length);
      var top = panel.kind === "categories" ? panel.vy[0] : 1 - panel.vy[1];
      var sx = 1 / (panel.vx[1] - panel.vx[0]), sy = 1 / (panel.vy[1] - panel.vy[0]);
      for (var k = 0; k < points.length; k += 2) {
        out[k] = b.x + sx * (points[k] - b.x - panel.vx[0] * b.w);
        out[k + 1] = b.y + sy * (points[k + 1] - b.y - top * b.h);
      }
      return out;
    }

    function shift(node, at, to) {
      node.setAttribute("transform", "translate(" + (to[0] - at[0]) + " " + (to[1] - at[1]) + ")");
    }

    function draw(panel) {
      prepare(panel);
      var b = panel.box, whole = panel.vx[1] - panel.vx[0] === 1 && panel.vy[1] - panel.vy[0] === 1;
      panel.shapes.forEach(function (s) { s.put(moved(panel, s.points)); });
      panel.node.querySelectorAll("svg").forEach(function (n) { n.style.display = whole ? "" : "none"; });
      panel.node.querySelectorAll("g.map").forEach(function (n) {
        var m = moved(panel, [0, 0, 1, 1]);
        n.setAttribute("transform", "matrix(" + [m[2] - m[0], 0, 0, m[3] - m[1], m[0], m[1]].join(" ") + ")");
      });
      panel.names.querySelectorAll("[data-at]").forEach(function (node) {
        var at = node.dataset.at.split(" ").map(function (v, k) { return v === "-" ? [b.x, b.y][k] : +v; });
        var free = node.dataset.at.split(" ").map(function (v) { return v === "-"; });
        var to = moved(panel, at).map(function (v, k) { return free[k] ? at[k] : v; });
        var out = (!free[0] && (to[0] < b.x - 1 || to[0] > b.x + b.w + 1)) ||
          (!free[1] && (to[1] < b.y - 1 || to[1] > b.y + b.h + 1));
        node.style.visibility = out ? "hidden" : "";
        shift(node, at, to);
      });
      if (panel === panels.find(function (p) { return p.group === "time"; })) {
        svg.querySelectorAll("[data-group='time'][data-at]").forEach(function (node) {
          var x = parseFloat(node.dataset.at), to = moved(panel, [x, b.y]);
          node.style.visibility = to[0] < b.x - 1 || to[0] > b.x + b.w + 1 ? "hidden" : "";
          shift(node, [x, b.y], [to[0], b.y]);
        });
      }
      if (whole) {
        panel.grid.innerHTML = panel.kept.grid;
        panel.ticks.innerHTML = panel.kept.ticks;
        return;
      }
      panel.grid.textContent = "";
      var keep = panel.kind === "categories";
      if (!keep) { panel.ticks.textContent = ""; } else { panel.ticks.innerHTML = panel.kept.ticks; }
      if (keep) {
        panel.ticks.querySelectorAll("text[text-anchor='middle']").forEach(function (n) { n.remove(); });
        panel.ticks.querySelectorAll("line").forEach(function (n) {
          if (n.getAttribute("x1") === n.getAttribute("x2")) { n.remove(); }
        });
      }
      ticks(panel.x, panel.vx, Math.max(2, b.w / 70)).forEach(function (tick) {
        var x = b.x + b.w * (panel.x.share(tick.at) - panel.vx[0]) / (panel.vx[1] - panel.vx[0]);
        element("line", {x1: x, x2: x, y1: b.y, y2: b.y + b.h, stroke: "#e6e9ed", "stroke-width": 0.8}, panel.grid);
        element("line", {x1: x, x2: x, y1: b.y + b.h, y2: b.y + b.h + 3.5, stroke: "#1b1f24", "stroke-width": 0.8}, panel.ticks);
        if (panel.named.indexOf("x") >= 0) {
          element("text", {x: x, y: b.y + b.h + 15, "font-size": 10, "text-anchor": "middle", fill: "#1b1f24"}, panel.ticks).textContent = tick.text;
        }
      });
      if (keep) { return; }
      ticks(panel.y, panel.vy, Math.max(2, Math.min(8, b.h / 16))).forEach(function (tick) {
        var y = b.y + b.h * (1 - (panel.y.share(tick.at) - panel.vy[0]) / (panel.vy[1] - panel.vy[0]));
        element("line", {x1: b.x, x2: b.x + b.w, y1: y, y2: y, stroke: "#e6e9ed", "stroke-width": 0.8}, panel.grid);
        element("line", {x1: b.x - 3.5, x2: b.x, y1: y, y2: y, stroke: "#1b1f24", "stroke-width": 0.8}, panel.ticks);
        if (panel.named.indexOf("y") >= 0) {
          element("text", {x: b.x - 6.5, y: y + 3.5, "font-size": 10, "text-anchor": "end", fill: "#1b1f24"}, panel.ticks).textContent = tick.text;
        }
      });
    }

    function here(event) {
      var frame = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
      return [(event.clientX - frame.left) * view.width / frame.width,
              (event.clientY - frame.top) * view.height / frame.height];
    }

    function panelAt(p) {
      return panels.find(function (one) {
        var b = one.box;
        return p[0] >= b.x && p[0] <= b.x + b.w && p[1] >= b.y && p[1] <= b.y + b.h;
      });
    }

    // Shares of the whole axes at a point of the picture.
    function shares(panel, p) {
      var b = panel.box;
      var u = (p[0] - b.x) / b.w, v = up(panel, (p[1] - b.y) / b.h);
      return [panel.vx[0] + u * (panel.vx[1] - panel.vx[0]), panel.vy[0] + v * (panel.vy[1] - panel.vy[0])];
    }

    // ---- Values under the pointer.

    var cross = element("g", {"pointer-events": "none"}, svg);

    function nearest(points, x, y) {
      var best = null, least = Infinity;
      for (var k = 0; k < points.length; k += 2) {
        var away = Math.abs(points[k] - x) + (y === null ? 0 : Math.abs(points[k + 1] - y));
        if (away < least) { least = away; best = k; }
      }
      return {k: best, away: least};
    }

    function clear() { cross.textContent = ""; tip.hidden = true; }

    function upright(panel, x) {
      var b = panel.box;
      if (x < b.x || x > b.x + b.w) { return; }
      element("line", {x1: x, x2: x, y1: b.y, y2: b.y + b.h, stroke: "#59626d", "stroke-width": 0.7}, cross);
    }

    function dot(panel, at, colour) {
      var b = panel.box, to = moved(panel, at);
      if (to[0] < b.x - 1 || to[0] > b.x + b.w + 1 || to[1] < b.y - 1 || to[1] > b.y + b.h + 1) { return; }
      element("circle", {cx: to[0], cy: to[1], r: panel.kind === "plane" ? 5 : 3, fill: "#fff", stroke: colour, "stroke-width": panel.kind === "plane" ? 2.4 : 1.6}, cross);
    }

    // The time of the nearest point of a path; null where there is none.
    function timeOn(panel, x, y) {
      var least = Infinity, time = null;
      panel.shapes.forEach(function (s) {
        if (!s.stamps) { return; }
        for (var k = 0; k < s.stamps.length; k += 1) {
          var away = Math.hypot(s.points[2 * k] - x, s.points[2 * k + 1] - y);
          if (away < least) { least = away; time = s.stamps[k]; }
        }
      });
      return time;
    }

    // A point of a path at a time, on the straight line between its points.
    function placeAt(s, time) {
      for (var k = 0; k + 1 < s.stamps.length; k += 1) {
        var a = s.stamps[k], c = s.stamps[k + 1];
        if (a <= time && time <= c) {
          var u = c > a ? (time - a) / (c - a) : 0;
          return [s.points[2 * k] + u * (s.points[2 * k + 2] - s.points[2 * k]),
                  s.points[2 * k + 1] + u * (s.points[2 * k + 3] - s.points[2 * k + 1])];
        }
      }
      return null;
    }

    charts.push({figure: figure, show: function (time) {
      clear();
      if (time === null) { return; }
      panels.forEach(function (panel) {
        var b = panel.box;
        if (panel.kind === "plane") {
          prepare(panel);
          panel.shapes.forEach(function (s) {
            var to = s.stamps ? placeAt(s, time) : null;
            if (to) { dot(panel, to, s.colour); }
          });
          return;
        }
        upright(panel, moved(panel, [b.x + panel.x.share(time) * b.w, b.y])[0]);
        if (panel.kind !== "time") { return; }
        prepare(panel);
        var at = b.x + panel.x.share(time) * b.w;
        panel.shapes.forEach(function (s) {
          if (!s.curve || s.symbols || !s.series || hidden[s.series]) { return; }
          var found = nearest(s.points, at, null);
          if (found.away < 2) { dot(panel, [s.points[found.k], s.points[found.k + 1]], s.colour); }
        });
      });
    }});

    function show(event) {
      var p = here(event), panel = panelAt(p);
      clear();
      if (!panel) { share(figure, null); return; }
      prepare(panel);
      var b = panel.box, at = shares(panel, p), flat = panel.kind !== "time";
      var ox = b.x + at[0] * b.w, oy = b.y + up(panel, at[1]) * b.h;
      var time = panel.kind === "plane" ? timeOn(panel, ox, oy) : panel.x.value(at[0]);
      share(figure, time);
      var rows = {}, order = [];
      panel.shapes.forEach(function (s) {
        if (!s.curve || s.series === null || s.series === "" || hidden[s.series] || !s.points.length) { return; }
        var found = nearest(s.points, ox, flat ? oy : null);
        if (found.away > (flat ? 14 : 8) * (panel.vx[1] - panel.vx[0]) + (flat ? 0 : 2)) { return; }
        if (rows[s.series] && rows[s.series].away <= found.away) { return; }
        if (!rows[s.series]) { order.push(s.series); }
        rows[s.series] = {away: found.away, x: s.points[found.k], y: s.points[found.k + 1], colour: s.colour};
      });
      if (!flat) {
        panels.forEach(function (one) {
          if (one.group === panel.group && one.box.x === b.x) { upright(one, p[0]); }
        });
      }
      if (!order.length) { return; }
      tip.textContent = "";
      var head = document.createElement("b");
      var title = panel.labels[0] || figure.dataset.xLabel || names[0];
      head.textContent = flat ? "" : title + " " + readable(panel.x, panel.vx, at[0]);
      if (head.textContent) { tip.appendChild(head); }
      order.slice(0, 12).forEach(function (series) {
        var row = rows[series], line = document.createElement("div");
        var mark = document.createElement("i"), text = readable(panel.y, panel.vy, up(panel, (row.y - b.y) / b.h));
        mark.style.background = row.colour;
        if (panel.kind === "categories") { text = ""; }
        if (flat) { text = readable(panel.x, panel.vx, (row.x - b.x) / b.w) + (text ? ", " + text : ""); }
        line.appendChild(mark);
        line.appendChild(document.createTextNode(series + " " + text));
        tip.appendChild(line);
        dot(panel, [row.x, row.y], row.colour);
      });
      if (panel.kind === "plane" && time !== null && figure.dataset.xLabel) {
        var stamp = document.createElement("div");
        stamp.textContent = figure.dataset.xLabel + " " + written(time, 0.01);
        tip.appendChild(stamp);
      }
      tip.hidden = false;
      var frame = figure.getBoundingClientRect(), x = event.clientX - frame.left + 14;
      if (x + tip.offsetWidth > frame.width) { x = event.clientX - frame.left - tip.offsetWidth - 14; }
      tip.style.left = Math.max(0, x) + "px";
      tip.style.top = event.clientY - frame.top + 14 + "px";
    }

    // ---- Drag to zoom, double-click to go back, a legend entry to hide its series.

    var begin = null, band = null;

    svg.addEventListener("pointerdown", function (event) {
      var p = here(event), panel = panelAt(p);
      if (event.pointerType === "touch") { show(event); }
      if (!panel || event.pointerType === "touch" || event.button !== 0) { return; }
      begin = {p: p, panel: panel};
      svg.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    svg.addEventListener("pointermove", function (event) {
      if (!begin) { show(event); return; }
      clear();
      var r = dragged(here(event));
      if (!band) { band = element("rect", {fill: "#0072B2", "fill-opacity": 0.12, stroke: "#0072B2", "stroke-width": 0.8}); svg.appendChild(band); }
      ["x", "y", "width", "height"].forEach(function (key, k) { band.setAttribute(key, r[k]); });
    });
    svg.addEventListener("pointerup", function (event) {
      if (!begin) { return; }
      var r = dragged(here(event)), panel = begin.panel;
      begin = null;
      if (band) { band.remove(); band = null; }
      if (r[2] < 6) { return; }
      var a = shares(panel, [r[0], r[1] + r[3]]), c = shares(panel, [r[0] + r[2], r[1]]);
      var vertical = r[3] < panel.box.h && panel.kind !== "categories";
      if (panel.kind === "plane") {
        // Both axes keep one scale.
        var span = Math.max(c[0] - a[0], c[1] - a[1]);
        var mx = (a[0] + c[0]) / 2, my = (a[1] + c[1]) / 2;
        a = [mx - span / 2, my - span / 2]; c = [mx + span / 2, my + span / 2];
        vertical = true;
      }
      panels.forEach(function (one) {
        if (one.group !== panel.group) { return; }
        one.vx = [a[0], c[0]];
        if (vertical && one === panel) { one.vy = [a[1], c[1]]; }
        draw(one);
      });
    });
    svg.addEventListener("pointerleave", function (event) {
      if (event.pointerType !== "touch") { clear(); share(figure, null); }
    });
    svg.addEventListener("dblclick", function () {
      panels.forEach(function (one) { one.vx = [0, 1]; one.vy = [0, 1]; draw(one); });
    });

    function dragged(p) {
      var b = begin.panel.box;
      var x0 = Math.max(b.x, Math.min(begin.p[0], p[0])), x1 = Math.min(b.x + b.w, Math.max(begin.p[0], p[0]));
      var y0 = Math.max(b.y, Math.min(begin.p[1], p[1])), y1 = Math.min(b.y + b.h, Math.max(begin.p[1], p[1]));
      // A level stroke selects a stretch of the horizontal axis alone.
      if (y1 - y0 < 12 || begin.panel.kind === "categories") { y0 = b.y; y1 = b.y + b.h; }
      return [x0, y0, x1 - x0, y1 - y0];
    }

    svg.querySelectorAll("[data-entry]").forEach(function (entry) {
      entry.setAttribute("tabindex", "0");
      entry.setAttribute("role", "button");
      entry.setAttribute("aria-pressed", "true");
      function toggle() {
        var name = entry.dataset.entry;
        hidden[name] = !hidden[name];
        entry.setAttribute("aria-pressed", String(!hidden[name]));
        entry.style.opacity = hidden[name] ? 0.35 : "";
        svg.querySelectorAll("[data-series]").forEach(function (node) {
          if (node.dataset.series === name) { node.style.display = hidden[name] ? "none" : ""; }
        });
      }
      entry.addEventListener("click", toggle);
      entry.addEventListener("keydown", function (event) {
        if (event.key === "Enter" || event.key === " ") { event.preventDefault(); toggle(); }
      });
    });
    figure.classList.add("live");
  }

  // ---- Scenes: bodies that move in space, drawn in parallel projection.

  function rotated(q, p) {
    var w = q[0], x = q[1], y = q[2], z = q[3];
    var tx = 2 * (y * p[2] - z * p[1]), ty = 2 * (z * p[0] - x * p[2]), tz = 2 * (x * p[1] - y * p[0]);
    return [p[0] + w * tx + y * tz - z * ty, p[1] + w * ty + z * tx - x * tz, p[2] + w * tz + x * ty - y * tx];
  }

  function scene(figure) {
    var data = JSON.parse(figure.querySelector("script").textContent);
    var canvas = figure.querySelector("canvas"), pen = canvas.getContext("2d");
    var slider = figure.querySelector("input"), shown = figure.querySelector("output");
    var button = figure.querySelector("button"), timer = null, frame = 0;
    var turn = data.view[0] * Math.PI / 180, above = data.view[1] * Math.PI / 180;
    var still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    var middle = [0, 1, 2].map(function (k) { return (data.low[k] + data.high[k]) / 2; });

    // Axes north, east, down; the viewer is at the azimuth `turn`, `above` the horizon.
    function page(p) {
      var n = p[0] - middle[0], e = p[1] - middle[1], d = p[2] - middle[2];
      var near = n * Math.cos(turn) + e * Math.sin(turn), side = n * Math.sin(turn) - e * Math.cos(turn);
      return [side, Math.sin(above) * near + Math.cos(above) * d, Math.cos(above) * near - Math.sin(above) * d];
    }

    function draw() {
      var wide = canvas.clientWidth, high = canvas.clientHeight, ratio = window.devicePixelRatio || 1;
      canvas.width = wide * ratio; canvas.height = high * ratio;
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.clearRect(0, 0, wide, high);
      var across = 0, up = 0;
      for (var c = 0; c < 8; c += 1) {
        var corner = page([0, 1, 2].map(function (k) { return (c >> k) & 1 ? data.high[k] : data.low[k]; }));
        across = Math.max(across, Math.abs(corner[0])); up = Math.max(up, Math.abs(corner[1]));
      }
      var size = Math.min((wide - 30) / 2 / across, (high - 30) / 2 / up);
      function at(p) { var f = page(p); return [wide / 2 + size * f[0], high / 2 + size * f[1], f[2]]; }
      function stroke(points, colour, width, dash) {
        pen.strokeStyle = colour; pen.lineWidth = width; pen.setLineDash(dash ? [6, 4] : []);
        pen.beginPath();
        var open = false;
        points.forEach(function (p) {
          if (p === null) { open = false; return; }
          var f = at(p);
          if (open) { pen.lineTo(f[0], f[1]); } else { pen.moveTo(f[0], f[1]); open = true; }
        });
        pen.stroke(); pen.setLineDash([]);
      }
      function word(text, p, colour, size_) {
        var f = at(p);
        pen.font = (size_ || 12) + "px Helvetica, Arial, sans-serif"; pen.fillStyle = colour;
        pen.textAlign = "center"; pen.textBaseline = "middle";
        pen.lineWidth = 3; pen.strokeStyle = "#ffffff"; pen.strokeText(text, f[0], f[1]);
        pen.fillText(text, f[0], f[1]);
      }
      data.lines.forEach(function (line) { stroke(line.points, line.colour, line.width, line.dash); });
      data.words.forEach(function (w) { word(w.text, w.at, w.colour, 11); });
      if (data.trail) {
        stroke(data.bodies[0].positions.slice(0, frame + 1), data.trail.colour, data.trail.width, false);
      }
      data.bodies.forEach(function (body) {
        var q = body.q[frame], p = body.positions ? body.positions[frame] : [0, 0, 0];
        if (q === null) { return; }
        function placed(v) { var r = rotated(q, v); return [r[0] + p[0], r[1] + p[1], r[2] + p[2]]; }
        var corners = body.corners.map(placed);
        if (body.wire) {
          body.faces.forEach(function (face) {
            stroke(face.concat(face[0]).map(function (k) { return corners[k]; }), body.colours[0], 1.5, true);
          });
        } else {
          var faces = body.faces.map(function (face, k) {
            var f = face.map(function (c) { return at(corners[c]); });
            return {f: f, colour: body.colours[k],
                    depth: f.reduce(function (sum, v) { return sum + v[2]; }, 0) / f.length};
          });
          faces.sort(function (a, b) { return a.depth - b.depth; });
          faces.forEach(function (face) {
            pen.beginPath();
            face.f.forEach(function (v, k) { if (k) { pen.lineTo(v[0], v[1]); } else { pen.moveTo(v[0], v[1]); } });
            pen.closePath();
            pen.fillStyle = face.colour; pen.fill();
            pen.strokeStyle = "#3d5166"; pen.lineWidth = 0.8; pen.stroke();
          });
        }
        (body.axes || []).forEach(function (axis) {
          stroke([placed([0, 0, 0]), placed(axis.tip)], axis.colour, 3.5, false);
          word(axis.name, placed(axis.tip.map(function (v) { return 1.1 * v; })), axis.colour, 12);
        });
      });
    }

    function go(k) {
      frame = k; slider.value = k; shown.textContent = data.frames[k];
      slider.setAttribute("aria-valuetext", data.frames[k]);
      draw();
    }
    function stop() { window.clearInterval(timer); timer = null; button.textContent = "Play"; }

    slider.max = data.frames.length - 1;
    button.addEventListener("click", function () {
      if (timer !== null) { stop(); return; }
      if (frame >= data.frames.length - 1) { go(0); }
      button.textContent = "Pause";
      timer = window.setInterval(function () {
        if (frame >= data.frames.length - 1) { stop(); } else { go(frame + 1); }
      }, data.interval_ms);
    });
    slider.addEventListener("input", function () { stop(); go(+slider.value); });
    button.hidden = still;
    var from = null;
    canvas.addEventListener("pointerdown", function (event) {
      from = [event.clientX, event.clientY, turn, above];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", function (event) {
      if (!from) { return; }
      turn = from[2] + (event.clientX - from[0]) / 150;
      above = Math.max(-1.5, Math.min(1.5, from[3] + (event.clientY - from[1]) / 150));
      draw();
    });
    canvas.addEventListener("pointerup", function () { from = null; });
    window.addEventListener("resize", draw);
    figure.classList.add("live");
    figure.querySelector(".controls").hidden = false;
    go(0);
  }

  // ---- Folded sections: opened by a link to them, all at once, and on paper.

  var folds = document.querySelectorAll("details");

  function unfold() {
    var target = document.getElementById(decodeURIComponent(window.location.hash.slice(1)));
    var fold = target && target.closest("details");
    if (fold && !fold.open) { fold.open = true; target.scrollIntoView(); }
  }

  if (folds.length) {
    window.addEventListener("hashchange", unfold);
    unfold();
    var before = [];
    window.addEventListener("beforeprint", function () {
      before = Array.prototype.map.call(folds, function (one) { return one.open; });
      folds.forEach(function (one) { one.open = true; });
    });
    window.addEventListener("afterprint", function () {
      folds.forEach(function (one, k) { one.open = before[k]; });
    });
    document.querySelectorAll("nav").forEach(function (nav) {
      var all = document.createElement("button");
      all.type = "button"; all.textContent = "Open all sections";
      all.addEventListener("click", function () {
        var open = all.textContent.charAt(0) === "O";
        folds.forEach(function (one) { one.open = open; });
        all.textContent = (open ? "Close" : "Open") + " all sections";
      });
      nav.appendChild(all);
    });
  }

  document.querySelectorAll("figure[data-figure]").forEach(function (figure) {
    try {
      (figure.dataset.figure === "scene" ? scene : chart)(figure);
    } catch (error) {
      figure.classList.remove("live");
    }
  });
})();
