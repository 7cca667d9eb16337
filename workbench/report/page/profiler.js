"use strict";
// The prediction profiler: the Kriging of the screening, evaluated in the page.
// Data: <script type="application/json" id="profiler-data">, arrays as base64 of little-endian float64.
// predict(point in the unit cube, words by their codes) -> { mean, sd }, as in surrogates/kriging/posterior.py.
(() => {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const floats = (text) => new Float64Array(bytes(text).buffer);

  function kriging(data) {
    const { n, d, p, kind, eta, terms, sigma2, shift, scale, new_run } = data;
    const isLabel = Array.from({ length: d }, (_, k) => data.labels.includes(k));
    const u = floats(data.u), theta = floats(data.theta), low = floats(data.low), width = floats(data.width);
    const weights = floats(data.weights), beta = floats(data.coefficients);
    const lower = floats(data.lower), q = floats(data.q), rf = floats(data.rf);
    const one = {
      gaussian: (h, t) => Math.exp(-t * h * h),
      power_exponential: (h, t) => Math.exp(-t * h ** eta),
      matern32: (h, t) => { const a = Math.sqrt(3 * t) * h; return (1 + a) * Math.exp(-a); },
      matern52: (h, t) => { const a = Math.sqrt(5 * t) * h; return (1 + a + a * a / 3) * Math.exp(-a); },
      matern72: (h, t) => {
        const a = Math.sqrt(7 * t) * h;
        return (1 + a + a * a * (6 + a) / 15) * Math.exp(-a);
      },
    }[kind];
    const r = new Float64Array(n), a = new Float64Array(n), x = new Float64Array(d);
    const f = new Float64Array(p), h = new Float64Array(p);

    return function predict(point) {
      for (let k = 0; k < d; k++) x[k] = (point[k] - low[k]) / width[k] - 0.5;
      for (let j = 0; j < p; j++) f[j] = terms[j].reduce((product, k) => product * x[k], 1);
      let mean = 0;
      for (let j = 0; j < p; j++) mean += f[j] * beta[j];
      for (let i = 0; i < n; i++) {
        let value = 1;
        for (let k = 0; k < d; k++) {
          const apart = Math.abs(x[k] - u[i * d + k]);
          value *= isLabel[k] ? (apart ? Math.exp(-theta[k]) : 1) : one(apart, theta[k]);
        }
        r[i] = value;
        mean += value * weights[i];
      }
      let variance = 1;                                   // 1 - a'a + h'h, a = L^-1 r, h = rf^-T f - q'a
      for (let i = 0, row = 0; i < n; row += ++i) {       // lower is packed by rows
        let sum = r[i];
        for (let j = 0; j < i; j++) sum -= lower[row + j] * a[j];
        a[i] = sum / lower[row + i];
        variance -= a[i] * a[i];
      }
      for (let j = 0; j < p; j++) {
        let sum = f[j];
        for (let k = 0; k < j; k++) sum -= rf[k * p + j] * h[k];
        h[j] = sum / rf[j * p + j];
      }
      for (let j = 0; j < p; j++) {
        let projected = h[j];
        for (let i = 0; i < n; i++) projected -= q[i * p + j] * a[i];
        variance += projected * projected;
      }
      return { mean: shift + scale * mean, sd: scale * Math.sqrt(sigma2 * (Math.max(variance, 0) + new_run)) };
    };
  }

  // The response of a Kriging's w, as in surrogates/analysis/response_map.py; ends of its 95 % band.
  function carriedBack({ scale, power, centre, unit, low, high }) {
    const half = 1.959963984540054;
    const boxCox = (w, l) => (Math.abs(l) < 1e-8 ? Math.exp(w) : Math.exp(Math.log1p(l * w) / l));
    const back = {
      none: (w) => w,
      log: (w) => Math.exp(w),
      "box-cox": (w) => boxCox(w, power),
      "yeo-johnson": (w) => (w >= 0 ? boxCox(w, power) - 1 : 1 - boxCox(-w, 2 - power)),
    }[scale];
    const of = (w) => (scale === "none" ? w : centre + unit * back(Math.min(Math.max(w, low), high)));
    return ({ mean, sd }) => ({ value: of(mean), lower: of(mean - half * sd), upper: of(mean + half * sd) });
  }

  // ---- the page ----------------------------------------------------------------------------------------
  const SVG = "http://www.w3.org/2000/svg";
  const BOX = { w: 240, h: 150, left: 46, right: 8, top: 8, bottom: 24 };

  function read(value) {
    if (typeof value !== "number") return String(value);
    if (value === 0) return "0";
    const size = Math.abs(value);
    return size >= 1e7 || size < 1e-4 ? value.toExponential(3) : String(Number(value.toPrecision(5)));
  }

  function physical(parameter, t) {
    if (parameter.levels.length) return parameter.levels[Math.round(t * (parameter.levels.length - 1))];
    if (t === 1) return parameter.upper;
    if (parameter.scale === "log") return parameter.lower * (parameter.upper / parameter.lower) ** t;
    return parameter.lower + t * (parameter.upper - parameter.lower);
  }

  function element(parent, name, attributes, text) {
    const svg = ["svg", "path", "line", "text", "circle"].includes(name);
    const made = svg ? document.createElementNS(SVG, name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return parent.appendChild(made);
  }

  function build(root, data) {
    const kriged = kriging(data), carried = carriedBack(data.map);
    const levelAt = (parameter, t) => Math.round(t * (parameter.levels.length - 1));
    const predict = (at) => carried(kriged(at.map((t, k) => {
      const { codes } = data.parameters[k];
      return codes ? codes[levelAt(data.parameters[k], t)] : t;
    })));
    const unit = data.unit === "1" ? "" : ` ${data.unit}`;
    const point = Float64Array.from(data.presets[0].point);
    const answer = root.querySelector(".profiler-answer"), grid = root.querySelector(".profiler-grid");
    const buttons = root.querySelector(".profiler-buttons");
    const cells = data.parameters.map((parameter, k) => cell(parameter, k));
    for (const preset of data.presets) {
      element(buttons, "button", { type: "button" }, preset.label).addEventListener("click", () => {
        point.set(preset.point);
        draw();
      });
    }

    function cell(parameter, k) {
      const box = element(grid, "div", { class: "profiler-cell" });
      const drawing = element(box, "svg", { viewBox: `0 0 ${BOX.w} ${BOX.h}`, "aria-hidden": "true" });
      const label = element(box, "label", {});
      const name = element(label, "span", {}, parameter.name);
      const levels = parameter.levels.length;
      const slider = element(label, "input", {
        type: "range", min: 0, max: 1, step: levels ? 1 / (levels - 1) : 0.005, "aria-label": parameter.name,
      });
      slider.addEventListener("input", () => { point[k] = Number(slider.value); draw(); });
      return { drawing, slider, name };
    }

    function line(k) {
      const parameter = data.parameters[k], count = parameter.levels.length || 41;
      const at = Float64Array.from(point), out = [];
      for (let i = 0; i < count; i++) {
        at[k] = count > 1 ? i / (count - 1) : 0;
        out.push({ t: at[k], ...predict(at) });
      }
      return out;
    }

    function draw() {
      const now = predict(point), lines = data.parameters.map((_, k) => line(k));
      let bottom = Infinity, top = -Infinity;
      for (const l of lines) for (const v of l) {
        bottom = Math.min(bottom, v.lower);
        top = Math.max(top, v.upper);
      }
      const span = top - bottom || 1;
      const X = (t) => BOX.left + t * (BOX.w - BOX.left - BOX.right);
      const Y = (y) => BOX.h - BOX.bottom - (y - bottom) / span * (BOX.h - BOX.top - BOX.bottom);
      answer.textContent = `${data.response} = ${read(now.value)}${unit}, 95 % band ` +
        `${read(now.lower)} to ${read(now.upper)}${unit}`;
      cells.forEach(({ drawing, slider, name }, k) => {
        const parameter = data.parameters[k], value = read(physical(parameter, point[k]));
        const shown = parameter.unit === "1" ? value : `${value} ${parameter.unit}`;
        slider.value = point[k];
        slider.setAttribute("aria-valuetext", shown);
        name.textContent = `${parameter.name} = ${shown}`;
        drawing.replaceChildren();
        const l = lines[k], up = l.map((v) => `${X(v.t)},${Y(v.upper)}`);
        const down = l.map((v) => `${X(v.t)},${Y(v.lower)}`).reverse();
        element(drawing, "path", {
          d: `M${BOX.left},${BOX.top}V${BOX.h - BOX.bottom}H${BOX.w - BOX.right}`, fill: "none", stroke: "#8a939d",
        });
        if (parameter.codes) {                            // nothing lies between words: a bar for each
          for (const v of l) {
            element(drawing, "line", {
              x1: X(v.t), x2: X(v.t), y1: Y(v.lower), y2: Y(v.upper), stroke: "#0072B2", "stroke-opacity": 0.4,
              "stroke-width": 5,
            });
            element(drawing, "circle", { cx: X(v.t), cy: Y(v.value), r: 3.5, fill: "#0072B2" });
          }
        } else {
          element(drawing, "path", { d: `M${[...up, ...down].join("L")}Z`, fill: "#0072B2", "fill-opacity": 0.18 });
          element(drawing, "path", {
            d: `M${l.map((v) => `${X(v.t)},${Y(v.value)}`).join("L")}`, fill: "none", stroke: "#0072B2", "stroke-width": 2,
          });
        }
        element(drawing, "line", {
          x1: X(point[k]), x2: X(point[k]), y1: BOX.top, y2: BOX.h - BOX.bottom, stroke: "#4d5761",
          "stroke-dasharray": "3 3",
        });
        element(drawing, "circle", { cx: X(point[k]), cy: Y(now.value), r: 4.5, fill: "#D55E00" });
        for (const y of [bottom, top]) {
          element(drawing, "text", { x: BOX.left - 5, y: Y(y) + (y === top ? 8 : 0), "text-anchor": "end" },
            String(Number(y.toPrecision(3))));
        }
        for (const t of [0, 1]) {
          element(drawing, "text", { x: X(t), y: BOX.h - 8, "text-anchor": t ? "end" : "start" },
            String(read(physical(parameter, t))));
        }
      });
    }
    draw();
  }

  const data = document.getElementById("profiler-data");
  if (data) {
    const content = JSON.parse(data.textContent), root = document.getElementById("profiler-panel");
    window.holdfast = Object.assign(window.holdfast || {}, { predict: kriging(content), carry: carriedBack(content.map || { scale: "none" }) });
    if (root) build(root, content);
  }
})();
