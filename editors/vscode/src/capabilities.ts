import { ClientCapabilities, FeatureState, StaticFeature } from "vscode-languageclient/node";
import { contributes } from "../package.json";

/** The commands of this extension that code lenses execute. */
const lensCommands = [
  "mauve.chooseSignificance",
  "mauve.showReferences",
  "mauve.showArchitecture",
  "mauve.showSchedule",
  "mauve.showStateMachine",
  "mauve.showChains",
  "mauve.whatIf",
];

/** What the server is told of this extension, beside what the client can do. */
export const ownCapabilities: StaticFeature = {
  fillClientCapabilities(capabilities: ClientCapabilities): void {
    // The types and modifiers of semantic tokens that are MAUVE's own: the server sends no others.
    const known = capabilities.textDocument?.semanticTokens;
    known?.tokenTypes.push(...contributes.semanticTokenTypes.map(({ id }) => id));
    known?.tokenModifiers.push(...contributes.semanticTokenModifiers.map(({ id }) => id));
    // Those of `Lenses`.
    capabilities.textDocument = { ...capabilities.textDocument, codeLens: {} };
    capabilities.workspace = { ...capabilities.workspace, codeLens: { refreshSupport: true } };
    capabilities.experimental = { ...(capabilities.experimental as object), commands: lensCommands };
  },
  initialize(): void {},
  getState(): FeatureState {
    return { kind: "static" };
  },
  clear(): void {},
};
