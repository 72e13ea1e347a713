// The part of a drawing that is seen: zoom and pan by the viewBox, so that nothing needs a style.

export interface Area {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** A place of the drawing at the top left, and how many pixels a unit of it has. */
export interface Place {
  x: number;
  y: number;
  scale: number;
}

const [least, most] = [0.1, 4];
/** Below this scale, texts cannot be read. */
const readable = 0.48;
/** The scale at the start where all would be too small. */
const start = 0.75;
/** So many pixels of the drawing stay in sight. */
const rest = 60;

/**
 * The place at which a drawing begins in a window: whole if it is readable then, otherwise its top left, and all that is wrong in
 * it. Where that is not readable either, the drawing is seen as a whole.
 */
export function initial(bounds: Area, window: { width: number; height: number }, wrong: Area[] = []): Place {
  const fitting = ({ width, height }: Area) => Math.min(window.width / width, window.height / height);
  if (fitting(bounds) >= readable) {
    return whole(bounds, window);
  }
  const topLeft = { x: bounds.x, y: bounds.y, scale: start };
  if (wrong.length === 0) {
    return topLeft;
  }
  const around = union(wrong);
  const scale = Math.min(start, fitting(around));
  return scale < readable ? whole(bounds, window) : revealed({ ...topLeft, scale }, around, window);
}

function union(areas: Area[]): Area {
  const margin = 24;
  const x = Math.min(...areas.map((it) => it.x)) - margin;
  const y = Math.min(...areas.map((it) => it.y)) - margin;
  const right = Math.max(...areas.map((it) => it.x + it.width)) + margin;
  const bottom = Math.max(...areas.map((it) => it.y + it.height)) + margin;
  return { x, y, width: right - x, height: bottom - y };
}

/** The place at which all of a drawing is seen. */
export function whole(bounds: Area, window: { width: number; height: number }): Place {
  const scale = Math.max(least, Math.min(1, window.width / bounds.width, window.height / bounds.height));
  const middle = (from: number, size: number, of: number) => from - Math.max(0, of / scale - size) / 2;
  return { x: middle(bounds.x, bounds.width, window.width), y: middle(bounds.y, bounds.height, window.height), scale };
}

/** The place after a zoom by a factor, which keeps the point of the drawing under a point of the window, in pixels. */
export function zoomed(place: Place, factor: number, at: { x: number; y: number }): Place {
  const scale = Math.min(most, Math.max(least, place.scale * factor));
  const kept = (from: number, pixels: number) => from + pixels / place.scale - pixels / scale;
  return { x: kept(place.x, at.x), y: kept(place.y, at.y), scale };
}

/** The place, moved so that a part of the drawing is in the window. */
export function clamped(place: Place, bounds: Area, window: { width: number; height: number }): Place {
  const margin = rest / place.scale;
  const within = (from: number, begin: number, size: number, of: number) =>
    Math.min(begin + size - margin, Math.max(begin + margin - of / place.scale, from));
  return {
    x: within(place.x, bounds.x, bounds.width, window.width),
    y: within(place.y, bounds.y, bounds.height, window.height),
    scale: place.scale,
  };
}

/** The place, moved as little as possible so that an area is in the window. */
export function revealed(place: Place, area: Area, window: { width: number; height: number }): Place {
  const margin = 12 / place.scale;
  const along = (from: number, begin: number, size: number, of: number) => {
    const length = of / place.scale;
    const last = begin + size + margin - length;
    return begin - margin < from ? begin - margin : last > from ? Math.min(begin - margin, last) : from;
  };
  return {
    x: along(place.x, area.x, area.width, window.width),
    y: along(place.y, area.y, area.height, window.height),
    scale: place.scale,
  };
}

/** The element that an arrow key leads to: the nearest one in its direction. */
export function neighbour(from: Area, others: Area[], direction: "left" | "right" | "up" | "down"): number | undefined {
  const middle = ({ x, y, width, height }: Area) => ({ x: x + width / 2, y: y + height / 2 });
  const here = middle(from);
  let found: number | undefined;
  let best = Infinity;
  others.forEach((other, index) => {
    const there = middle(other);
    const [dx, dy] = [there.x - here.x, there.y - here.y];
    const [along, across] = direction === "left" || direction === "right" ? [Math.abs(dx), Math.abs(dy)] : [Math.abs(dy), Math.abs(dx)];
    const isAhead = { left: dx < -1, right: dx > 1, up: dy < -1, down: dy > 1 }[direction];
    // What is aside counts double, so that rows and columns are followed.
    const distance = along + 2 * across;
    if (isAhead && distance < best) {
      best = distance;
      found = index;
    }
  });
  return found;
}
