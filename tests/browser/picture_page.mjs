// The page's elements as SVG. It runs in the page, so it uses nothing from outside the function.

/** The parts of the picture from back to front; where the canvas lies stands CANVAS. */
export function drawPage() {
  const parts = [];
  const short = (value) => Number(value.toFixed(1));
  const tag = (name, attributes, content = '') => {
    const written = Object.entries(attributes).filter(([, value]) => value !== '' && value !== undefined);
    const head = `<${name}${written.map(([key, value]) => ` ${key}="${typeof value === 'number' ? short(value) : value}"`).join('')}`;
    return content ? `${head}>${content}</${name}>` : `${head}/>`;
  };
  const put = (...element) => parts.push(tag(...element));
  const isClear = (colour) => colour === 'rgba(0, 0, 0, 0)' || colour === 'transparent';
  const hex = (colour) => (isClear(colour) ? 'none' : `#${colour.match(/\d+/g).slice(0, 3).map((x) => Number(x).toString(16).padStart(2, '0')).join('')}`);
  const variable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  /** A line of text: its size, and where its baseline lies below its top. */
  function measure(text, { fontFamily, fontSize, fontWeight, fontVariantNumeric }) {
    const line = document.createElement('span');
    const foot = document.createElement('i');
    Object.assign(line.style, { position: 'absolute', top: 0, whiteSpace: 'pre', fontFamily, fontSize, fontWeight, fontVariantNumeric });
    foot.style.display = 'inline-block';
    line.append(text, foot);
    document.body.append(line);
    const range = document.createRange();
    range.selectNode(line.firstChild);
    const { top, width, height } = range.getBoundingClientRect();
    const baseline = foot.getBoundingClientRect().bottom - top;
    line.remove();
    return { width, height, baseline };
  }

  function drawBox({ left, top, width, height }, style) {
    const sides = ['Top', 'Right', 'Bottom', 'Left'].map((side) => {
      const thickness = parseFloat(style[`border${side}Width`]);
      return isClear(style[`border${side}Color`]) ? 0 : thickness;
    });
    const fill = hex(style.backgroundColor);
    const isFramed = sides.every((thickness) => thickness > 0);
    if (isFramed || fill !== 'none') {
      const inset = isFramed ? sides[0] / 2 : 0;
      const given = style.borderTopLeftRadius;
      const radius = Math.min(parseFloat(given) * (given.endsWith('%') ? width / 100 : 1), height / 2) - inset;
      put('rect', { x: left + inset, y: top + inset, width: width - 2 * inset, height: height - 2 * inset, rx: radius > 0 ? radius : '', fill,
        stroke: isFramed ? hex(style.borderTopColor) : '' });
    }
    if (isFramed) return;
    const [up, right, down, start] = sides;
    const side = (x, y, w, h, colour) => put('rect', { x, y, width: w, height: h, fill: hex(colour) });
    if (up) side(left, top, width, up, style.borderTopColor);
    if (right) side(left + width - right, top, right, height, style.borderRightColor);
    if (down) side(left, top + height - down, width, down, style.borderBottomColor);
    if (start) side(left, top, start, height, style.borderLeftColor);
  }

  function drawText(text, { left, top, width, height }, style) {
    const line = measure(text, style);
    const written = text.replace(/&/g, '&amp;').replace(/</g, '&lt;');
    put('text', { x: left, y: top + (height - line.height) / 2 + line.baseline, 'font-size': parseFloat(style.fontSize),
      'font-weight': style.fontWeight === '400' ? '' : style.fontWeight, fill: hex(style.color), textLength: width }, written);
  }

  /** A text node, line by line. */
  function drawLines(node) {
    const range = document.createRange();
    const lines = [];
    for (let i = 0; i < node.length; i++) {
      range.setStart(node, i);
      range.setEnd(node, i + 1);
      const [rect] = range.getClientRects();
      if (!rect?.width) continue;
      const last = lines.at(-1);
      if (last && Math.abs(last.top - rect.top) < 2) last.end = i + 1;
      else lines.push({ top: rect.top, start: i, end: i + 1 });
    }
    for (const { start, end } of lines) {
      const text = node.data.slice(start, end);
      range.setStart(node, start + text.search(/\S|$/));
      range.setEnd(node, start + text.trimEnd().length);
      if (text.trim()) drawText(text.trim(), range.getBoundingClientRect(), getComputedStyle(node.parentElement));
    }
  }

  function drawSelect(select, { left, right, top, height }, style) {
    const text = select.selectedOptions[0].text;
    const { width } = measure(text, style);
    drawText(text, { left: left + parseFloat(style.borderLeftWidth) + parseFloat(style.paddingLeft), top, width, height }, style);
    put('path', { d: `M${short(right - 21)} ${short(top + height / 2 - 2.5)}h10l-5 5z`, fill: variable('--dim') });
  }

  function drawSlider({ value, min, max }, { left, top, width, height }) {
    const [x, y] = [left + 8 + ((value - min) / (max - min)) * (width - 16), top + height / 2];
    put('rect', { x: left, y: y - 2, width, height: 4, rx: 2, fill: variable('--line') });
    put('circle', { cx: x, cy: y, r: 8.5, fill: variable('--bg'), stroke: variable('--accent') });
    put('circle', { cx: x, cy: y, r: 6, fill: variable('--accent') });
  }

  /** A drawing of the page's own, with its style sheet's rules written out. */
  function drawDrawing(svg, { left, top, width, height }, style) {
    const shapes = [...svg.children].map((shape) => {
      const { fill, stroke, strokeWidth, opacity, vectorEffect } = getComputedStyle(shape);
      const own = Object.fromEntries(['x', 'y', 'width', 'height', 'x1', 'x2', 'y1', 'y2', 'd'].filter((name) => shape.hasAttribute(name))
        .map((name) => [name, name === 'd' ? shape.getAttribute(name) : Number(shape.getAttribute(name))]));
      return tag(shape.tagName, { ...own, fill: shape.tagName === 'line' ? '' : fill === 'none' ? fill : hex(fill),
        ...(stroke !== 'none' && { stroke: hex(stroke), 'stroke-width': strokeWidth.replace('px', ''), 'vector-effect': vectorEffect }),
        opacity: opacity === '1' ? '' : opacity });
    });
    put('svg', { x: left, y: top, width, height, viewBox: svg.getAttribute('viewBox'), overflow: style.overflow === 'visible' ? 'visible' : '',
      preserveAspectRatio: svg.getAttribute('preserveAspectRatio') ?? '' }, shapes.join(''));
  }

  /** A chart of curves, as uPlot has it: grid, labels, curves. */
  function drawPlot(plot, { left, top }) {
    const at = (value, scale) => plot.valToPos(value, scale, true) / devicePixelRatio;
    const area = Object.fromEntries(Object.entries(plot.bbox).map(([name, value]) => [name, value / devicePixelRatio]));
    const shapes = [];
    const text = (x, y, anchor, content) => tag('text', { x, y, 'font-size': 11, 'text-anchor': anchor, fill: variable('--dim') }, content);
    const [across, up] = plot.axes;
    up._splits.forEach((value, i) => {
      const y = at(value, 'y');
      shapes.push(tag('path', { d: `M${short(area.left)} ${short(y)}h${short(area.width)}`, stroke: variable('--line') }), text(area.left - 8, y + 4, 'end', up._values[i]));
    });
    across._splits.forEach((value, i) => {
      const x = at(value, 'x');
      shapes.push(tag('path', { d: `M${short(x)} ${short(area.top)}v${short(area.height)}`, stroke: variable('--line') }), text(x, area.top + area.height + 16, 'middle', across._values[i]));
    });
    const [times, ...columns] = plot.data;
    columns.forEach((values, k) => {
      const path = values.map((value, i) => (value === null ? '' : `${i === 0 || values[i - 1] === null ? 'M' : 'L'}${short(at(times[i], 'x'))} ${short(at(value, 'y'))}`)).join('');
      shapes.push(tag('path', { d: path, fill: 'none', stroke: variable(`--c${k}`), 'stroke-width': 1.6 }));
    });
    put('svg', { x: left, y: top, width: plot.width, height: plot.height }, shapes.join(''));
  }

  function drawElement(element) {
    const box = element.getBoundingClientRect();
    const style = getComputedStyle(element);
    if (!element.checkVisibility({ opacityProperty: true }) || box.bottom <= 0 || box.top >= innerHeight) return;
    if (element.id === 'view') {
      parts.push('CANVAS');
      return;
    }
    if (element.tagName === 'CANVAS') {
      drawPlot(element.closest('.chart').plot, box);
      return;
    }
    if (element.type !== 'range') drawBox(box, style);
    const before = getComputedStyle(element, '::before');
    if (before.content !== 'none') {
      const [width, height] = [parseFloat(before.width), parseFloat(before.height)];
      drawBox({ left: box.left, top: box.top + (box.height - height) / 2, width, height }, before);
    }
    if (element.tagName === 'SELECT') drawSelect(element, box, style);
    else if (element.type === 'range') drawSlider(element, box);
    else if (element.tagName === 'svg') drawDrawing(element, box, style);
    else for (const child of element.childNodes) {
      if (child.nodeType === Node.TEXT_NODE) drawLines(child);
      else if (child.nodeType === Node.ELEMENT_NODE) drawElement(child);
    }
  }

  // What the daemon took differs from run to run.
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) texts.currentNode.data = texts.currentNode.data.replace(/\d+\.\d ms$/, '0.2 ms');

  drawElement(document.body);
  const { left, top, width, height } = document.getElementById('view').getBoundingClientRect();
  return { parts, canvas: { left, top, width, height }, family: getComputedStyle(document.body).fontFamily.replaceAll('"', "'") };
}
