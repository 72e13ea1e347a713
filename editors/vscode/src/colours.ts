import { ClientCapabilities, FeatureState, StaticFeature } from "vscode-languageclient/node";
import { contributes } from "../package.json";

/** Tells the server of the types and modifiers of semantic tokens that are MAUVE's own: it sends no others. */
export class OwnColours implements StaticFeature {
  fillClientCapabilities(capabilities: ClientCapabilities): void {
    const known = capabilities.textDocument?.semanticTokens;
    known?.tokenTypes.push(...contributes.semanticTokenTypes.map(({ id }) => id));
    known?.tokenModifiers.push(...contributes.semanticTokenModifiers.map(({ id }) => id));
  }

  initialize(): void {}

  getState(): FeatureState {
    return { kind: "static" };
  }

  clear(): void {}
}
