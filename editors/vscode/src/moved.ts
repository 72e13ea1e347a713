import type { Position } from "vscode-languageclient";

/** A change of a text, as VS Code tells it. */
interface Change {
  range: { start: Position; end: Position };
  text: string;
}

/** Where a position is after a change. */
export function moved(position: Position, { range: { start, end }, text }: Change): Position {
  const isBefore = end.line < position.line || (end.line === position.line && end.character <= position.character);
  if (!isBefore) {
    return position;
  }
  const lines = text.split("\n");
  const line = position.line + lines.length - 1 - (end.line - start.line);
  const last = lines.at(-1)!.length + (lines.length === 1 ? start.character : 0);
  const character = end.line === position.line ? position.character - end.character + last : position.character;
  return { line, character };
}
