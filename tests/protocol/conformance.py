"""What a server must not say to a client that has not announced that it understands it.

pytest-lsp checks a few of these; here are those that matter to what MAUVE does. Each check looks at messages as they came,
since some of what is wrong with them is lost when they are made into objects."""

from dataclasses import dataclass, field


def at(value, path, otherwise=None):
    """What stands in nested objects, such as `at(capabilities, "textDocument.hover.contentFormat")`."""
    for name in path.split("."):
        if not isinstance(value, dict) or value.get(name) is None:
            return otherwise
        value = value[name]
    return value


@dataclass
class Conformance:
    """The checks for one client, as its capabilities are in JSON."""

    client: dict
    server: dict = field(default_factory=dict)
    faults: list = field(default_factory=list)
    # Whether the client has asked for the diagnostics of all files, closed ones as well.
    has_all: bool = False

    def announced(self, path):
        return bool(at(self.client, path, False))

    def expect(self, fine, what):
        if not fine:
            self.faults.append(what)

    def only_if(self, path, used, what):
        """Something is used only where the client has announced it."""
        self.expect(not used or self.announced(path), f"{what}, and the client has not announced {path}")

    # What the server says by itself.

    def said(self, method, params):
        refreshes = {
            "workspace/inlayHint/refresh": "workspace.inlayHint.refreshSupport",
            "workspace/codeLens/refresh": "workspace.codeLens.refreshSupport",
            "workspace/semanticTokens/refresh": "workspace.semanticTokens.refreshSupport",
            "workspace/diagnostic/refresh": "workspace.diagnostics.refreshSupport",
            "workspace/configuration": "workspace.configuration",
            "workspace/applyEdit": "workspace.applyEdit",
            "window/workDoneProgress/create": "window.workDoneProgress",
            "window/showDocument": "window.showDocument.support",
            "workspace/workspaceFolders": "workspace.workspaceFolders",
        }
        if method in refreshes:
            self.only_if(refreshes[method], True, method)
        if method == "workspace/applyEdit":
            self.edit(params["edit"])
        if method == "client/registerCapability":
            for registration in params["registrations"]:
                name = registration["method"].replace("workspace/", "workspace.").replace("textDocument/", "textDocument.")
                self.only_if(f"{name}.dynamicRegistration", True, f"{registration['method']} is registered")
                for watcher in at(registration, "registerOptions.watchers", []):
                    self.only_if(
                        "workspace.didChangeWatchedFiles.relativePatternSupport",
                        isinstance(watcher["globPattern"], dict),
                        "a relative pattern",
                    )
        if method == "textDocument/publishDiagnostics":
            # Those of closed files, which have no version, are, until it asks for those of all files.
            is_asked_for = self.announced("textDocument.diagnostic") and self.server.get("diagnosticProvider")
            is_open = params.get("version") is not None
            self.expect(
                not (is_asked_for and params["diagnostics"] and (is_open or self.has_all)),
                "diagnostics are published to a client that asks for them",
            )
            # Its version is passed over by a client that does not interpret it: nothing is wrong with that.
            self.diagnostics(params["diagnostics"], "textDocument.publishDiagnostics")

    def diagnostics(self, diagnostics, place):
        for it in diagnostics:
            self.only_if(f"{place}.relatedInformation", it.get("relatedInformation"), "related places")
            self.only_if(f"{place}.codeDescriptionSupport", it.get("codeDescription"), "a page behind a code")
            self.only_if(f"{place}.dataSupport", it.get("data") is not None, "data of a diagnostic")
            known = at(self.client, f"{place}.tagSupport.valueSet", [])
            self.expect(set(it.get("tags", [])) <= set(known), f"tags {it.get('tags')} of a diagnostic")

    # What the server says that it can do.

    def initialized(self, result):
        self.server = result["capabilities"]
        encodings = at(self.client, "general.positionEncodings", ["utf-16"])
        encoding = self.server.get("positionEncoding", "utf-16")
        self.expect(encoding in encodings, f"positions in {encoding}, of {encodings}")
        rename = self.server.get("renameProvider")
        self.only_if("textDocument.rename.prepareSupport", isinstance(rename, dict), "options of rename")
        action = self.server.get("codeActionProvider")
        self.only_if("textDocument.codeAction.codeActionLiteralSupport", isinstance(action, dict), "options of code actions")
        changes = at(self.server, "workspace.workspaceFolders.supported", False)
        self.only_if("workspace.workspaceFolders", changes, "folders")

    # What the server answers.

    def answered(self, method, result):
        self.has_all |= method == "workspace/diagnostic"
        check = {
            "initialize": self.initialized,
            "textDocument/hover": self.hover,
            "textDocument/definition": lambda it: self.places(it, "definition"),
            "textDocument/declaration": lambda it: self.places(it, "declaration"),
            "textDocument/typeDefinition": lambda it: self.places(it, "typeDefinition"),
            "textDocument/implementation": lambda it: self.places(it, "implementation"),
            "textDocument/completion": self.completion,
            "completionItem/resolve": lambda it: self.completion_item(it, []),
            "textDocument/signatureHelp": self.signature_help,
            "textDocument/documentSymbol": self.document_symbols,
            "workspace/symbol": self.workspace_symbols,
            "textDocument/codeAction": self.code_actions,
            "codeAction/resolve": lambda it: self.code_actions([it]),
            "textDocument/rename": self.edit,
            "workspace/willRenameFiles": self.edit,
            "textDocument/foldingRange": self.folding_ranges,
            "textDocument/documentLink": self.document_links,
            "textDocument/semanticTokens/full": self.tokens,
            "textDocument/semanticTokens/range": self.tokens,
            "textDocument/diagnostic": lambda it: self.diagnostics(it.get("items", []), "textDocument.publishDiagnostics"),
        }.get(method)
        if check and result is not None:
            check(result)

    def markup(self, value, path, what):
        """Text that may be marked up; where nothing is announced, plain text is understood."""
        if isinstance(value, dict):
            kinds = at(self.client, path, [])
            self.expect(value.get("kind") in kinds or (not kinds and value.get("kind") == "plaintext"), f"{what} in {value.get('kind')}, of {kinds}")

    def hover(self, result):
        self.markup(result["contents"], "textDocument.hover.contentFormat", "a hover")

    def places(self, result, name):
        links = isinstance(result, list) and any("targetUri" in it for it in result)
        self.only_if(f"textDocument.{name}.linkSupport", links, f"links of {name}")

    def completion(self, result):
        if isinstance(result, dict):
            known = at(self.client, "textDocument.completion.completionList.itemDefaults", [])
            defaults = [name for name, value in (result.get("itemDefaults") or {}).items() if value is not None]
            self.expect(set(defaults) <= set(known), f"defaults {defaults} of completions, of {known}")
            result = result["items"]
        else:
            defaults = []
        for item in result:
            self.completion_item(item, defaults)

    def completion_item(self, item, _):
        place = "textDocument.completion.completionItem"
        self.only_if(f"{place}.snippetSupport", item.get("insertTextFormat") == 2, "a snippet")
        self.markup(item.get("documentation"), f"{place}.documentationFormat", "documentation")
        self.only_if(f"{place}.labelDetailsSupport", item.get("labelDetails"), "details of a label")
        self.only_if(f"{place}.commitCharactersSupport", item.get("commitCharacters"), "commit characters")
        self.only_if(f"{place}.preselectSupport", item.get("preselect"), "a preselected completion")
        self.only_if(f"{place}.deprecatedSupport", item.get("deprecated"), "a deprecated completion")
        self.only_if(f"{place}.insertReplaceSupport", "insert" in (item.get("textEdit") or {}), "insert and replace")
        self.expect(set(item.get("tags", [])) <= set(at(self.client, f"{place}.tagSupport.valueSet", [])), "a tag")
        modes = at(self.client, f"{place}.insertTextModeSupport.valueSet", [])
        self.expect(item.get("insertTextMode") in [None, *modes], "a mode of insertion")
        kinds = at(self.client, "textDocument.completion.completionItemKind.valueSet", range(1, 19))
        self.expect(item.get("kind") is None or item["kind"] in kinds, f"a completion of kind {item.get('kind')}")
        text = item.get("textEdit")
        if text and "range" in text:
            self.expect(text["range"]["start"]["line"] == text["range"]["end"]["line"], "a completion of several lines")

    def signature_help(self, result):
        place = "textDocument.signatureHelp.signatureInformation"
        for signature in result["signatures"]:
            self.markup(signature.get("documentation"), f"{place}.documentationFormat", "documentation")
            self.only_if(f"{place}.activeParameterSupport", signature.get("activeParameter") is not None, "an active parameter")
            for parameter in signature.get("parameters") or []:
                self.markup(parameter.get("documentation"), f"{place}.documentationFormat", "documentation")
                self.only_if(f"{place}.parameterInformation.labelOffsetSupport", isinstance(parameter["label"], list), "offsets")

    def document_symbols(self, result):
        kinds = at(self.client, "textDocument.documentSymbol.symbolKind.valueSet", range(1, 19))
        nested = any("selectionRange" in it for it in result)
        self.only_if("textDocument.documentSymbol.hierarchicalDocumentSymbolSupport", nested, "symbols in symbols")
        rest = list(result)
        while rest:
            symbol = rest.pop()
            rest += symbol.get("children") or []
            self.expect(symbol["kind"] in kinds, f"a symbol of kind {symbol['kind']}")
            known = at(self.client, "textDocument.documentSymbol.tagSupport.valueSet", [])
            self.expect(set(symbol.get("tags") or []) <= set(known), "a tag of a symbol")

    def workspace_symbols(self, result):
        kinds = at(self.client, "workspace.symbol.symbolKind.valueSet", range(1, 19))
        for symbol in result:
            self.expect(symbol["kind"] in kinds, f"a symbol of kind {symbol['kind']}")
            self.only_if("workspace.symbol.resolveSupport", "range" not in symbol["location"], "a symbol without a range")

    def code_actions(self, result):
        place = "textDocument.codeAction"
        for action in result:
            if isinstance(action.get("command"), str):
                continue
            self.only_if(f"{place}.codeActionLiteralSupport", True, "a code action")
            self.only_if(f"{place}.disabledSupport", action.get("disabled"), "a disabled code action")
            self.only_if(f"{place}.dataSupport", action.get("data") is not None, "data of a code action")
            if action.get("edit"):
                self.edit(action["edit"])
            elif not action.get("command") and not action.get("disabled"):
                properties = at(self.client, f"{place}.resolveSupport.properties", [])
                self.expect("edit" in properties, "a code action whose edit must be asked for")

    def edit(self, edit):
        place = "workspace.workspaceEdit"
        changes = edit.get("documentChanges")
        # Who makes, moves or removes files takes changes of documents, since that is where it is told to.
        if not self.announced(f"{place}.resourceOperations"):
            self.only_if(f"{place}.documentChanges", changes, "changes of documents")
        annotations = edit.get("changeAnnotations") or {}
        self.only_if(f"{place}.changeAnnotationSupport", edit.get("changeAnnotations"), "annotations of changes")
        for change in changes or []:
            if "kind" in change:
                kinds = at(self.client, f"{place}.resourceOperations", [])
                self.expect(change["kind"] in kinds, f"an operation {change['kind']}, of {kinds}")
            else:
                annotated = any("annotationId" in it for it in change["edits"])
                self.only_if(f"{place}.changeAnnotationSupport", annotated, "an annotated change")
            used = [it["annotationId"] for it in [change, change.get("options") or {}, *change.get("edits", [])] if it.get("annotationId")]
            self.expect(set(used) <= set(annotations), f"annotations {used} that are not among {list(annotations)}")

    def folding_ranges(self, result):
        limit = at(self.client, "textDocument.foldingRange.rangeLimit", len(result))
        self.expect(len(result) <= limit, f"{len(result)} folds, of {limit}")
        for fold in result:
            whole = self.announced("textDocument.foldingRange.lineFoldingOnly")
            self.expect(not whole or fold["startLine"] < fold["endLine"], f"a fold in a line: {fold}")
            self.only_if("textDocument.foldingRange.foldingRange.collapsedText", fold.get("collapsedText"), "a fold's text")

    def document_links(self, result):
        for link in result:
            self.only_if("textDocument.documentLink.tooltipSupport", link.get("tooltip"), "a link's tooltip")

    def tokens(self, result):
        types = at(self.server, "semanticTokensProvider.legend.tokenTypes", [])
        modifiers = at(self.server, "semanticTokensProvider.legend.tokenModifiers", [])
        data = result["data"]
        self.expect(len(data) % 5 == 0, "tokens are five numbers each")
        end = 0
        for line, start, length, kind, flags in zip(*[iter(data)] * 5):
            self.expect(length > 0 and (line > 0 or start >= end), "tokens that overlap")
            self.expect(kind < len(types) and flags < 1 << len(modifiers), f"a token that the legend does not have: {kind}, {flags}")
            end = length
