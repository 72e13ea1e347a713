// What the workbench shows while an activity, a program and a table are typed, looked at in every frame: no activity may lose
// its figure, each has one when its line is complete, and nothing may move. Also measures how long a figure takes to follow a key.

/** Types text as a person does: 8 keys a second. */
const PAUSE = 125;

/** Looks at each frame from now on, until `seen` is called. */
export async function watch(page) {
  await page.evaluate(() => {
    const drawn = (span) => {
      const { content } = getComputedStyle(span, "::after");
      return content.startsWith('"') ? content.slice(1, -1) : "";
    };
    // The rows of each line that is in sight with its end: VS Code numbers the first row of a line.
    const linesOf = (editor) => {
      const top = (element) => element.getBoundingClientRect().top;
      const numbers = [...editor.querySelectorAll(".line-numbers")].filter((it) => it.textContent !== "");
      const begins = new Set(numbers.map(top));
      const lines = [];
      for (const row of [...editor.querySelectorAll(".view-line")].sort((one, other) => top(one) - top(other))) {
        begins.has(top(row)) ? lines.push([row]) : lines.at(-1)?.push(row);
      }
      return lines.slice(0, -1);
    };
    const watched = { frames: 0, activities: 0, awaited: [], without: [], before: [], moved: [], older: 0, keys: [], delays: [], on: true };
    const tops = new Map();
    const known = new Set();
    let shown = new Set();
    let last = "";
    const look = () => {
      if (!watched.on) {
        return;
      }
      watched.frames++;
      let all = "";
      const present = new Set();
      watched.awaited = [];
      for (const rows of [...document.querySelectorAll(".editor-instance")].flatMap(linesOf)) {
        const text = rows.map((row) => row.textContent).join("").replaceAll("\u00a0", " ").trim();
        const name = /^activity (\w+)/.exec(text)?.[1];
        if (name === undefined) {
          continue;
        }
        const spans = rows.flatMap((row) => [...row.querySelectorAll("span")]);
        const figure = spans.map(drawn).join("");
        const at = spans.findIndex((span) => drawn(span) !== "");
        if (at >= 0 && spans.slice(at + 1).some((span) => span.childElementCount === 0 && span.textContent !== "")) {
          watched.before.push(text);
        }
        watched.activities++;
        all += `${name}: ${figure}\n`;
        watched.older += /… /.test(figure) ? 1 : 0;
        // A name that is being typed is that of no instance.
        known.add(watched.frames === 1 ? name : "");
        // Until the server has the last key of a name, what is shown is that of the name before.
        const isOfPrefix = figure.includes("instance unknown");
        const { left, top } = rows[0].getBoundingClientRect();
        // The same text may be shown in two editors.
        const seenAs = `${name} at ${left}`;
        if (known.has(name) && !isOfPrefix) {
          if (figure !== "" && !figure.startsWith("?")) {
            present.add(seenAs);
          } else {
            // A slow server needs its time for a name that is new, and no figure that was there vanishes.
            watched[shown.has(seenAs) ? "without" : "awaited"].push(`${text} ${figure}`);
          }
        }
        const place = `${text} at ${left}`;
        if (tops.has(place) && tops.get(place) !== top) {
          watched.moved.push(`${place}: ${tops.get(place)} to ${top}`);
        }
        tops.set(place, top);
      }
      shown = present;
      if (all !== last && watched.keys.length > 0) {
        watched.delays.push(performance.now() - watched.keys.at(-1));
        watched.keys = [];
      }
      last = all;
      nextFrame();
    };
    // What is painted: after all that VS Code does in a frame. Before, its style sheet may be newer than its lines. So an element
    // changes its size in each frame, which is observed after the layout.
    const changing = document.body.appendChild(document.createElement("div"));
    changing.style.position = "absolute";
    new ResizeObserver(look).observe(changing);
    const nextFrame = () =>
      requestAnimationFrame(() => {
        changing.style.width = `${1 + (watched.frames % 2)}px`;
      });
    addEventListener("keydown", () => watched.keys.push(performance.now()), { capture: true });
    window.watched = watched;
    nextFrame();
  });
}

export function seen(page) {
  return page.evaluate(() => {
    window.watched.on = false;
    return window.watched;
  });
}

const median = (all) => [...all].sort((one, other) => one - other)[Math.floor(all.length / 2)] ?? NaN;

/** Types while every frame is looked at. */
export async function checkWhile(page, what, type) {
  await watch(page);
  await type((text) => page.keyboard.type(text, { delay: PAUSE }));
  await page.waitForTimeout(300);
  const { frames, activities, awaited, without, before, moved, older, delays } = await seen(page);
  console.log(
    `seen: while ${what} is typed: ${without.length} of ${activities} figures in ${frames} frames vanish, ${older} are older; ` +
      `${delays.length} changes, ${Math.round(median(delays))} ms after a key (median)`,
  );
  if (activities === 0 || without.length > 0) {
    throw new Error(`expected: every activity keeps a figure while ${what} is typed\n  seen: ${without.slice(0, 5).join("\n  ")}`);
  }
  if (awaited.length > 0) {
    throw new Error(`expected: every activity has a figure when ${what} is typed\n  seen: ${awaited.join("\n  ")}`);
  }
  if (before.length > 0) {
    throw new Error(`expected: no figure stands before the text of its line\n  seen: ${before.slice(0, 5).join("\n  ")}`);
  }
  if (moved.length > 0) {
    throw new Error(`expected: no line moves while ${what} is typed\n  seen: ${moved.slice(0, 5).join("\n  ")}`);
  }
}
