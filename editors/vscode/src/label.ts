import type { InlayHint } from "vscode-languageclient";

/** The statuses of hints that the extension draws: all but values, which are VS Code's inlay hints. */
export const statuses = ["met", "tight", "missed", "unknown", "older", "time"] as const;
export type Status = (typeof statuses)[number];

/** A hint with what the server says of it. */
export interface Figure extends Pick<InlayHint, "position"> {
  label: string;
  data: {
    status: Status;
    load?: number;
    /** Texts that say the same in fewer and fewer words; the label is one of them. */
    labels?: string[];
  };
}

/** The status of several figures at one place. */
export function worst(figures: Figure[]): Status {
  const order: Status[] = ["older", "missed", "unknown", "tight", "met", "time"];
  return order.find((status) => figures.some(({ data }) => data.status === status)) ?? "time";
}

/** The number of characters of a bar, and what the last of them may be. */
const full = 5;
const eighths = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];

/** The bar of a CPU, and nothing of others: the last character is for the last 10 %, so that 94 % and 99.7 % differ. */
function bar({ data: { load } }: Figure): string {
  if (load === undefined) {
    return "";
  }
  const used = load <= 90 ? (load / 90) * (full - 1) : full - 1 + (load - 90) / 10;
  // Up to 100 % may be rounded.
  const steps = Math.min(Math.floor(used * 8), full * 8 - (load > 100 ? 0 : 1));
  return ` ${("█".repeat(Math.floor(steps / 8)) + eighths[steps % 8]).padEnd(full, "░")}`;
}

/** The figure, marked as that of an earlier text as the server does it. */
function asOlder(figure: Figure): Figure {
  const { label, data } = figure;
  if (data.status === "older") {
    return figure;
  }
  const older = (text: string) => `… ${text.replace(/^[✓!✗?–]( |$)/, "")}`.trimEnd();
  const labels = [...(data.labels ?? [label]).map(older), "…"];
  return { ...figure, label: older(label), data: { ...data, status: "older", labels } };
}

/** What stands for a figure where there is no room for more. */
const mark = /^[✓!✗?–…]$/;

/**
 * What is drawn of the figures at the end of a line, in at most `room` columns: with bars, without, in fewer words, without the
 * last figures, and at last a mark. Late ones are marked as those of an earlier text.
 */
export function text(known: Figure[], room: number, isLate = false): string {
  const figures = isLate ? known.map(asOlder) : known;
  const texts = ({ label, data: { labels } }: Figure) => labels ?? [label];
  const shorter = (figure: Figure, by: number) => texts(figure)[Math.min(by, texts(figure).length - 1)];
  let found = figures.map((figure) => shorter(figure, 0) + bar(figure)).join(" · ");
  for (let count = figures.length; count > 0; count--) {
    const shown = figures.slice(0, count);
    const most = Math.max(...shown.map((figure) => texts(figure).length));
    for (let by = 0; found.length > room && by < most; by++) {
      const parts = shown.map((figure) => shorter(figure, by));
      if (count === 1 || !parts.some((part) => mark.test(part))) {
        found = parts.join(" · ");
      }
    }
  }
  return found;
}
