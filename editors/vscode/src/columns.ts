/** How much room there is behind a line. VS Code says how wide a group of editors is, but not how wide its text is. */

/** What the columns of an editor depend on. */
export interface Look {
  /** The width of the editor's group, in pixels. VS Code does not say it where no groups stand beside each other. */
  width: number | undefined;
  fontFamily: string;
  fontSize: number;
  tabSize: number;
  hasMinimap: boolean;
  /** Whether lines are wrapped at the right edge. */
  isWrapped: boolean;
}

/** The width of a character, as a part of the font's size: of the usual fonts, only Consolas is narrower. */
const [usual, consolas] = [0.603, 0.55];
/** The height of a line, as a part of the font's size. */
const lineHeight = 1.35;
/** The digits of line numbers, for which VS Code leaves room. */
const digits = 3;
/** The controls that fold the text, and the scroll bar, in pixels. */
const [folding, scrollBar] = [26, 16];
/** The widest minimap, and what it has beside its text, in pixels. */
const [widestMap, besideMap] = [128, 8];

/** The width of a group on a screen of 1440 pixels, beside the explorer. */
const ofSmallScreen = 1082;

/** The columns of text that an editor shows: VS Code shows, and wraps at, the whole ones. */
export function columns({ width = ofSmallScreen, fontFamily, fontSize, hasMinimap }: Look): number {
  const column = fontSize * (fontFamily.startsWith("Consolas") ? consolas : usual);
  const text = width - folding - fontSize * lineHeight - digits * column - scrollBar;
  // The map has a pixel for each column of the text.
  const map = hasMinimap ? Math.min(widestMap, text / (column + 1) + besideMap) : 0;
  return Math.max(1, (text - map) / column);
}

/** So many columns more or less may be shown: fonts differ. */
const unsure = 0.25;

/** The columns behind the end of a line that are in sight: less than none where the line is longer than the editor is wide. */
export function room(line: string, look: Look): number {
  const shown = columns(look);
  const wrappedAt = look.isWrapped ? [shown - unsure, shown + unsure].map(Math.floor) : [Infinity];
  return Math.floor(shown) - Math.max(...wrappedAt.map((at) => lastRow(line, at, look.tabSize)));
}

function widthAt(column: number, text: string, tabSize: number): number {
  return text === "\t" ? tabSize - (column % tabSize) : 1;
}

function widthOf(text: string, tabSize: number): number {
  return [...text].reduce((column, it) => column + widthAt(column, it, tabSize), 0);
}

/** The characters after and before which VS Code wraps lines: those that models have. */
const [after, before] = [" \t})]?|/&.,;", "([{"];

/** The width of the last row of a line that VS Code wraps at a column; later rows are indented as the first. */
export function lastRow(line: string, wrappedAt: number, tabSize: number): number {
  const characters = [...line];
  const spaces = widthOf(/^\s*/.exec(line)![0], tabSize);
  const indentation = spaces + 2 > wrappedAt ? 0 : spaces;
  let [column, row, end, canWrapAt] = [0, 0, wrappedAt, 0];
  characters.forEach((it, index) => {
    const previous = characters[index - 1] ?? it;
    const isAfter = after.includes(previous) && !after.includes(it);
    const isBefore = before.includes(it) && !before.includes(previous);
    canWrapAt = it !== " " && (isAfter || isBefore) ? column : canWrapAt;
    const next = column + widthAt(column, it, tabSize);
    if (next > end) {
      const isTooLong = canWrapAt <= row || next - canWrapAt > wrappedAt - indentation;
      row = isTooLong ? column : canWrapAt;
      end = row + wrappedAt - indentation;
    }
    column = next;
  });
  return row === 0 ? column : column - row + indentation;
}

/** A part of VS Code's layout of editor groups: one group, or several beside or below each other. */
export interface Layout {
  size?: number;
  groups?: Layout[];
}

/** The width of each editor group, in the order of VS Code's view columns; nothing where it is not known. */
export function widths({ orientation, groups }: { orientation: number; groups: Layout[] }): (number | undefined)[] {
  // Groups stand beside each other, those in one of them below each other, and so on.
  const visit = (part: Layout, isBeside: boolean, around?: number): (number | undefined)[] => {
    const width = isBeside ? part.size : around;
    return part.groups?.flatMap((inner) => visit(inner, !isBeside, width)) ?? [width];
  };
  return groups.flatMap((part) => visit(part, orientation === 0));
}
