//! The requests of the protocol, for tests that send all of them: the capability of each one, and its parameters.
//! Requests that a server does not answer are omitted and listed.

use serde_json::{Value, json};

use crate::client::{Client, Text};

/// A request.
#[derive(Debug)]
pub struct Method {
    /// Its name.
    pub name: &'static str,
    /// A JSON pointer to its entry in the server's capabilities. Requests of MAUVE have no entry.
    pub provider: &'static str,
    /// Its parameters.
    pub asked: Asked,
}

/// The parameters of a request.
#[derive(Debug, Clone, Copy)]
pub enum Asked {
    /// A place.
    At(fn(&Location) -> Value),
    /// Parts of the answer to another request, possibly several.
    With(&'static str, fn(&Location, &Value) -> Vec<Value>),
}

/// A place in a text.
#[derive(Debug, Clone)]
pub struct Location {
    /// The text's address.
    pub uri: String,
    /// A position.
    pub position: Value,
    /// A range.
    pub range: Value,
    /// A word: a new name, or a search text.
    pub word: String,
}

impl Location {
    /// The place of some bytes of a text.
    pub fn of(text: &Text, range: std::ops::Range<usize>, word: &str) -> Location {
        let (start, end) = (text.position(range.start), text.position(range.end));
        Location {
            uri: text.uri.clone(),
            position: start.clone(),
            range: json!({"start": start, "end": end}),
            word: word.to_owned(),
        }
    }
}

impl Method {
    /// Returns whether a server with these capabilities answers it.
    fn is_answered_by(&self, client: &mut Client, capabilities: &Value) -> bool {
        if self.provider == OWN {
            return client.call(self.name, json!({})).err().is_none_or(|error| error["code"] != -32601);
        }
        let provider = capabilities.pointer(self.provider);
        provider.is_some_and(|it| !it.is_null() && *it != json!(false))
    }

    /// The request with this name.
    pub fn named(name: &str) -> Option<&'static Method> {
        METHODS.iter().find(|method| method.name == name)
    }
}

/// The requests that a server answers, which has said that it has these capabilities; and the names of those that it does not.
pub fn methods_of(client: &mut Client, capabilities: &Value) -> (Vec<&'static Method>, Vec<&'static str>) {
    let (answered, others): (Vec<_>, Vec<_>) =
        METHODS.iter().partition(|method| method.is_answered_by(client, capabilities));
    (answered, others.iter().map(|method| method.name).collect())
}

/// All requests about texts.
pub const METHODS: &[Method] = &[
    at("textDocument/hover", "/hoverProvider", position),
    at("textDocument/definition", "/definitionProvider", position),
    at("textDocument/declaration", "/declarationProvider", position),
    at("textDocument/typeDefinition", "/typeDefinitionProvider", position),
    at("textDocument/implementation", "/implementationProvider", position),
    at("textDocument/references", "/referencesProvider", |place| {
        and(position(place), json!({"context": {"includeDeclaration": true}}))
    }),
    at("textDocument/documentHighlight", "/documentHighlightProvider", position),
    at("textDocument/completion", "/completionProvider", |place| {
        and(position(place), json!({"context": {"triggerKind": 1}}))
    }),
    with("completionItem/resolve", "/completionProvider/resolveProvider", "textDocument/completion", each),
    at("textDocument/signatureHelp", "/signatureHelpProvider", position),
    at("textDocument/prepareRename", "/renameProvider/prepareProvider", position),
    at("textDocument/rename", "/renameProvider", |place| {
        and(position(place), json!({"newName": place.word}))
    }),
    at("workspace/willRenameFiles", "/workspace/fileOperations/willRename", |place| {
        let new = place.uri.replace(".mal", "_renamed.mal");
        json!({"files": [{"oldUri": place.uri, "newUri": new}]})
    }),
    at("textDocument/documentSymbol", "/documentSymbolProvider", document),
    at("workspace/symbol", "/workspaceSymbolProvider", |place| json!({"query": place.word})),
    with("workspaceSymbol/resolve", "/workspaceSymbolProvider/resolveProvider", "workspace/symbol", each),
    at("textDocument/foldingRange", "/foldingRangeProvider", document),
    at("textDocument/selectionRange", "/selectionRangeProvider", |place| {
        and(document(place), json!({"positions": [place.position, place.range["end"]]}))
    }),
    at("textDocument/documentLink", "/documentLinkProvider", document),
    with("documentLink/resolve", "/documentLinkProvider/resolveProvider", "textDocument/documentLink", each),
    at("textDocument/codeLens", "/codeLensProvider", document),
    at("textDocument/codeAction", "/codeActionProvider", |place| {
        and(range(place), json!({"context": {"diagnostics": []}}))
    }),
    with("codeAction/resolve", "/codeActionProvider/resolveProvider", "textDocument/codeAction", each),
    at("textDocument/inlayHint", "/inlayHintProvider", |place| {
        and(document(place), json!({"range": {"start": line(0), "end": line(1_000_000)}}))
    }),
    with("inlayHint/resolve", "/inlayHintProvider/resolveProvider", "textDocument/inlayHint", each),
    at("textDocument/formatting", "/documentFormattingProvider", |place| and(document(place), formatting())),
    at("textDocument/rangeFormatting", "/documentRangeFormattingProvider", |place| {
        and(range(place), formatting())
    }),
    at("textDocument/onTypeFormatting", "/documentOnTypeFormattingProvider", |place| {
        and(and(position(place), formatting()), json!({"ch": "\n"}))
    }),
    at("textDocument/semanticTokens/full", "/semanticTokensProvider/full", document),
    with(
        "textDocument/semanticTokens/full/delta",
        "/semanticTokensProvider/full/delta",
        "textDocument/semanticTokens/full",
        |place, answer| with_result_id(document(place), answer),
    ),
    at("textDocument/semanticTokens/range", "/semanticTokensProvider/range", range),
    at("textDocument/prepareCallHierarchy", "/callHierarchyProvider", position),
    with(
        "callHierarchy/incomingCalls",
        "/callHierarchyProvider",
        "textDocument/prepareCallHierarchy",
        each_as_item,
    ),
    with(
        "callHierarchy/outgoingCalls",
        "/callHierarchyProvider",
        "textDocument/prepareCallHierarchy",
        each_as_item,
    ),
    at("textDocument/prepareTypeHierarchy", "/typeHierarchyProvider", position),
    with(
        "typeHierarchy/supertypes",
        "/typeHierarchyProvider",
        "textDocument/prepareTypeHierarchy",
        each_as_item,
    ),
    with(
        "typeHierarchy/subtypes",
        "/typeHierarchyProvider",
        "textDocument/prepareTypeHierarchy",
        each_as_item,
    ),
    at("textDocument/diagnostic", "/diagnosticProvider", document),
    at(
        "workspace/diagnostic",
        "/diagnosticProvider/workspaceDiagnostics",
        |_| json!({"previousResultIds": []}),
    ),
    at("mauve/analysis", OWN, document),
    at("mauve/generate", OWN, document),
    at("mauve/graph", OWN, position),
    at("mauve/stateMachine", OWN, position),
    at("mauve/schedule", OWN, position),
    at("mauve/probability", OWN, position),
    at("mauve/chains", OWN, position),
    at("mauve/cpuBudget", OWN, position),
    at("mauve/whatIf", OWN, position),
    at("mauve/executionTimes", OWN, position),
    at("mauve/syntaxTree", OWN, document),
];

/// In place of a provider.
const OWN: &str = "";

const fn at(name: &'static str, provider: &'static str, params: fn(&Location) -> Value) -> Method {
    Method { name, provider, asked: Asked::At(params) }
}

const fn with(
    name: &'static str,
    provider: &'static str,
    other: &'static str,
    params: fn(&Location, &Value) -> Vec<Value>,
) -> Method {
    Method { name, provider, asked: Asked::With(other, params) }
}

fn document(place: &Location) -> Value {
    json!({"textDocument": {"uri": place.uri}})
}

fn position(place: &Location) -> Value {
    and(document(place), json!({"position": place.position}))
}

fn range(place: &Location) -> Value {
    and(document(place), json!({"range": place.range}))
}

fn formatting() -> Value {
    json!({"options": {"tabSize": 2, "insertSpaces": true}})
}

fn line(number: u32) -> Value {
    json!({"line": number, "character": 0})
}

/// The items of an answer: a list, or an object with `items`.
fn each(_: &Location, answer: &Value) -> Vec<Value> {
    let items = answer.get("items").unwrap_or(answer);
    items.as_array().cloned().unwrap_or_default()
}

fn each_as_item(place: &Location, answer: &Value) -> Vec<Value> {
    each(place, answer).into_iter().map(|item| json!({"item": item})).collect()
}

fn with_result_id(params: Value, answer: &Value) -> Vec<Value> {
    let id = answer.get("resultId").filter(|id| id.is_string());
    id.into_iter().map(|id| and(params.clone(), json!({"previousResultId": id}))).collect()
}

/// The fields of both.
fn and(mut one: Value, other: Value) -> Value {
    if let (Some(one), Value::Object(other)) = (one.as_object_mut(), other) {
        one.extend(other);
    }
    one
}

/// A client with all capabilities: those of VS Code and Neovim, and newer ones. Diagnostics are published, or requested
/// if it `asks`; columns are in the first of `encodings` that the server supports.
pub fn able_client(asks: bool, encodings: &[&str]) -> Value {
    let markup = json!(["markdown", "plaintext"]);
    let refresh = json!({"refreshSupport": true});
    let link = json!({"linkSupport": true});
    let symbols: Vec<u32> = (1..=26).collect();
    let all = [
        "namespace",
        "type",
        "class",
        "enum",
        "interface",
        "struct",
        "typeParameter",
        "parameter",
        "variable",
        "property",
        "enumMember",
        "event",
        "function",
        "method",
        "macro",
        "keyword",
        "modifier",
        "comment",
        "string",
        "number",
        "regexp",
        "operator",
        "decorator",
    ];
    let mut capabilities = json!({
        "general": {"positionEncodings": encodings},
        "window": {"workDoneProgress": true, "showMessage": {}, "showDocument": {"support": true}},
        "workspace": {
            "applyEdit": true, "workspaceFolders": true, "configuration": true,
            "workspaceEdit": {
                "documentChanges": true, "resourceOperations": ["create", "rename", "delete"],
                "failureHandling": "textOnlyTransactional", "changeAnnotationSupport": {"groupsOnLabel": true},
            },
            "symbol": {"symbolKind": {"valueSet": symbols}, "resolveSupport": {"properties": ["location.range"]}},
            "fileOperations": {"willRename": true, "didRename": true},
            "inlayHint": refresh, "codeLens": refresh, "semanticTokens": refresh,
        },
        "textDocument": {
            "synchronization": {"didSave": true},
            "hover": {"contentFormat": markup},
            "definition": link, "declaration": link, "typeDefinition": link, "implementation": link,
            "references": {}, "documentHighlight": {},
            "completion": {
                "contextSupport": true,
                "completionItem": {
                    "snippetSupport": true, "documentationFormat": markup, "labelDetailsSupport": true,
                    "insertReplaceSupport": true, "deprecatedSupport": true, "tagSupport": {"valueSet": [1]},
                    "resolveSupport": {"properties": ["documentation", "detail", "additionalTextEdits"]},
                    "insertTextModeSupport": {"valueSet": [1, 2]},
                },
            },
            "signatureHelp": {
                "contextSupport": true,
                "signatureInformation": {
                    "documentationFormat": markup, "activeParameterSupport": true,
                    "parameterInformation": {"labelOffsetSupport": true},
                },
            },
            "documentSymbol": {
                "hierarchicalDocumentSymbolSupport": true, "symbolKind": {"valueSet": symbols},
            },
            "codeAction": {
                "dataSupport": true, "isPreferredSupport": true, "disabledSupport": true,
                "honorsChangeAnnotations": true, "resolveSupport": {"properties": ["edit", "command"]},
                "codeActionLiteralSupport": {"codeActionKind": {"valueSet": [
                    "", "quickfix", "refactor", "refactor.rewrite", "source",
                    "source.organizeImports", "source.fixAll",
                ]}},
            },
            "codeLens": {}, "documentLink": {"tooltipSupport": true}, "formatting": {}, "rangeFormatting": {},
            "onTypeFormatting": {},
            "rename": {"prepareSupport": true, "honorsChangeAnnotations": true},
            "foldingRange": {"foldingRange": {"collapsedText": true}}, "selectionRange": {},
            "publishDiagnostics": {
                "relatedInformation": true, "versionSupport": true, "codeDescriptionSupport": true,
                "dataSupport": true, "tagSupport": {"valueSet": [1, 2]},
            },
            "callHierarchy": {}, "typeHierarchy": {},
            "semanticTokens": {
                "requests": {"range": true, "full": {"delta": true}}, "tokenTypes": all, "formats": ["relative"],
                "tokenModifiers": ["declaration", "definition", "readonly", "modification", "defaultLibrary"],
                "augmentsSyntaxTokens": true,
            },
            "inlayHint": {"resolveSupport": {"properties": ["tooltip", "textEdits", "label.location"]}},
        },
    });
    if asks {
        capabilities["textDocument"]["diagnostic"] = json!({"relatedDocumentSupport": true});
        capabilities["workspace"]["diagnostics"] = refresh;
    }
    capabilities
}
