"""The server as pytest-lsp's clients see it: with the capabilities that VS Code, Neovim and Emacs announce, it is asked
everything that it says it can be asked, all over the sample robot. Each message must be what the specification says, with
nothing in it that is not there; and nothing is used that the client has not announced (conformance.py)."""

import copy
import os
import re
import shutil
import uuid
from pathlib import Path

import pytest
from conformance import Conformance, at
from lsprotocol import types
from lsprotocol.converters import get_converter
from pygls.exceptions import JsonRpcException
from pygls.protocol import default_converter
from pytest_lsp import LanguageClient, client_capabilities
from pytest_lsp.client import register_lsp_features
from pytest_lsp.protocol import LanguageClientProtocol

MODEL = Path(__file__).parent.parent / "models" / "p3dx"
#: VS Code of today asks for diagnostics, and shows hints; the one that pytest-lsp knows is of 2022.
NEWER = "visual-studio-code, newer"
CLIENTS = ["visual-studio-code", NEWER, "neovim", "neovim@v0.10", "emacs"]
#: Where a request may be answered by an error: there is nothing to be had, or a text has changed.
LEGITIMATE = {-32801, -32803}
CONVERTER = get_converter()


class Protocol(LanguageClientProtocol):
    """Looks at each message before it is made into an object."""

    def __init__(self, *arguments, **named):
        super().__init__(*arguments, **named)
        self.conformance = None
        self.asked = {}
        self.said = []

    def send_request(self, method, params=None, callback=None, msg_id=None):
        msg_id = msg_id or str(uuid.uuid4())
        self.asked[msg_id] = method
        return super().send_request(method, params, callback, msg_id)

    def structure_message(self, data):
        # It is called for the objects in a message as well.
        if "jsonrpc" not in data:
            return data
        raw = copy.deepcopy(data)
        message = super().structure_message(data)
        method = raw.get("method") or self.asked.get(raw.get("id"))
        self.conformance.expect(method is not None, f"an answer to nothing: {raw}")
        if method in types.METHOD_TO_TYPES:
            lost = difference(raw, self._converter.unstructure(message))
            self.conformance.expect(not lost, f"{method}: what the specification does not have: {lost}")
        if "method" in raw:
            self.said.append(raw)
            self.conformance.said(method, raw.get("params"))
        elif "error" not in raw:
            self.conformance.answered(method, raw["result"])
        return message


def difference(raw, understood, path=""):
    """Where a message says something that is lost when it is understood; what servers may fill themselves is passed over."""
    if path.endswith((".data", ".arguments", ".experimental", ".value", ".registerOptions")) and "Tokens" not in path:
        return None
    if isinstance(raw, dict) and isinstance(understood, dict):
        for name, value in raw.items():
            if value is not None:
                if lost := difference(value, understood.get(name), f"{path}.{name}"):
                    return lost
        return None
    if isinstance(raw, list) and isinstance(understood, list) and len(raw) == len(understood):
        return next((lost for it in zip(raw, understood) if (lost := difference(*it, path))), None)
    return None if raw == understood else f"{path}: {raw!r} is understood as {understood!r}"


def announced(client):
    """The capabilities of a client."""
    capabilities = client_capabilities(client.partition(",")[0])
    if client == NEWER:
        text, workspace = capabilities.text_document, capabilities.workspace
        text.diagnostic = types.DiagnosticClientCapabilities(related_document_support=True)
        text.inlay_hint = types.InlayHintClientCapabilities(resolve_support=types.ClientInlayHintResolveOptions(["tooltip"]))
        text.type_hierarchy = types.TypeHierarchyClientCapabilities()
        workspace.diagnostics = types.DiagnosticWorkspaceClientCapabilities(refresh_support=True)
        workspace.inlay_hint = types.InlayHintWorkspaceClientCapabilities(refresh_support=True)
    return capabilities


def converter():
    """That of lsprotocol, which takes an action that has a command for a command."""
    made = default_converter()

    def action(it, _):
        return made.structure(it, types.Command if isinstance(it.get("command"), str) else types.CodeAction)

    made.register_structure_hook(types.Command | types.CodeAction, action)
    return made


class Session:
    """A client, and the files of the robot as it has them."""

    def __init__(self, client, folder):
        self.client, self.folder, self.texts = client, folder, {}

    async def begin(self, capabilities):
        self.client.protocol.conformance = Conformance(CONVERTER.unstructure(capabilities))
        folder = types.WorkspaceFolder(uri=self.folder.as_uri(), name="p3dx")
        parameters = types.InitializeParams(capabilities=capabilities, workspace_folders=[folder])
        result = await self.client.initialize_session(parameters)
        self.server = CONVERTER.unstructure(result.capabilities)
        self.encoding = self.server.get("positionEncoding", "utf-16")
        for path in sorted(self.folder.rglob("*.mal")):
            self.open(path)
        # The robot is in order; here is something to be set right.
        self.open(self.folder / "untidy.mal", "codel   f( ):int\nshell S{\n input port x:int\n}\n")
        # The old side of a diff, and an address that is none.
        old = self.folder / "deployment.mal"
        self.open_at(f"git:{old}?HEAD", old.read_text().replace("deadline = 1000", "deadline = 7"))
        del self.texts[self.open_at(f"_diff_right:{old}", "codel f(")]

    def open(self, path, text=None):
        return self.open_at(path.as_uri(), path.read_text() if text is None else text)

    def open_at(self, uri, text):
        self.texts[uri] = text
        document = types.TextDocumentItem(uri=uri, language_id="mauve", version=1, text=text)
        self.client.text_document_did_open(types.DidOpenTextDocumentParams(text_document=document))
        return uri

    def change(self, uri, version, old, new):
        text = self.texts[uri]
        start = text.index(old)
        edges = [self.position(text, start), self.position(text, start + len(old))]
        change = {"range": {"start": edges[0], "end": edges[1]}, "text": new}
        self.notify("textDocument/didChange", {"textDocument": {"uri": uri, "version": version}, "contentChanges": [change]})
        self.texts[uri] = text[:start] + new + text[start + len(old) :]

    def notify(self, method, parameters):
        kind = types.METHOD_TO_TYPES[method][2]
        self.client.protocol.notify(method, CONVERTER.structure(parameters, kind))

    def position(self, text, offset):
        line = text[:offset].rpartition("\n")[2]
        width = {"utf-8": lambda it: len(it.encode()), "utf-16": lambda it: len(it.encode("utf-16-le")) // 2, "utf-32": len}
        return {"line": text[:offset].count("\n"), "character": width[self.encoding](line)}

    async def ask(self, method, parameters):
        """The answer as JSON; none, where it is a legitimate error."""
        kind = types.METHOD_TO_TYPES[method][2]
        try:
            result = await self.client.protocol.send_request_async(method, CONVERTER.structure(parameters, kind))
        except JsonRpcException as error:
            assert error.code in LEGITIMATE, f"{method} {parameters}: {error}"
            return None
        return CONVERTER.unstructure(result, kind_of_result(method)) if result is not None else None

    def places(self, step):
        """Words all over the texts, each as a request may ask for it; a third of them, unless all is searched."""
        if 3 < step < 100 and "MAUVE_ALL" not in os.environ:
            step *= 3
        first = int(os.environ.get("MAUVE_SEED", "0")) % step
        for uri, text in self.texts.items():
            words = list(re.finditer(r"\w+", text))
            for word in words[first % len(words) :: step]:
                start, end = (self.position(text, it) for it in word.span())
                yield {
                    "textDocument": {"uri": uri}, "position": end if word.start() % 2 else start,
                    "range": {"start": start, "end": end},
                }

    async def check(self):
        """What was found wrong with all that the server has said; and it ends well."""
        await self.client.shutdown_session()
        faults = self.client.protocol.conformance.faults
        assert not faults, "\n".join(sorted(set(faults))[:20])
        assert self.client._server.returncode == 0


def kind_of_result(method):
    response = types.METHOD_TO_TYPES[method][1]
    return response.__annotations__["result"] if not isinstance(response.__annotations__["result"], str) else None


@pytest.fixture(params=CLIENTS)
async def session(request, tmp_path):
    shutil.copytree(MODEL, tmp_path / "p3dx")
    client = LanguageClient(protocol_cls=Protocol, converter_factory=converter)
    register_lsp_features(client)
    for refresh in ["inlayHint", "codeLens", "semanticTokens"]:
        client.feature(f"workspace/{refresh}/refresh")(lambda *_: None)
    client.feature("workspace/applyEdit")(lambda *_: types.ApplyWorkspaceEditResult(applied=True))
    for method in ["client/registerCapability", "client/unregisterCapability"]:
        client.feature(method)(lambda *_: None)
    await client.start_io(os.environ["MAUVE_TEST_SERVER"], "lsp")
    session = Session(client, tmp_path / "p3dx")
    await session.begin(announced(request.param))
    yield session
    await session.check()
    await client.stop()


def items(answer):
    return answer.get("items", []) if isinstance(answer, dict) else answer or []


def at_position(place):
    return {name: place[name] for name in ["textDocument", "position"]}


def at_range(place):
    return {name: place[name] for name in ["textDocument", "range"]}


def in_text(place):
    return {"textDocument": place["textDocument"]}


FORMATTING = {"options": {"tabSize": 2, "insertSpaces": True}}
WHOLE = {"start": {"line": 0, "character": 0}, "end": {"line": 10_000, "character": 0}}

#: Each request, where the server says that it answers it, and what it is asked with; how many words are between two places.
REQUESTS = {
    "textDocument/hover": ("hoverProvider", at_position, 10),
    "textDocument/definition": ("definitionProvider", at_position, 10),
    "textDocument/declaration": ("declarationProvider", at_position, 10),
    "textDocument/typeDefinition": ("typeDefinitionProvider", at_position, 10),
    "textDocument/implementation": ("implementationProvider", at_position, 10),
    "textDocument/references": ("referencesProvider", lambda it: {**at_position(it), "context": {"includeDeclaration": True}}, 10),
    "textDocument/documentHighlight": ("documentHighlightProvider", at_position, 10),
    "textDocument/completion": ("completionProvider", lambda it: {**at_position(it), "context": {"triggerKind": 1}}, 40),
    "textDocument/signatureHelp": ("signatureHelpProvider", at_position, 5),
    "textDocument/prepareRename": ("renameProvider.prepareProvider", at_position, 10),
    "textDocument/rename": ("renameProvider", lambda it: {**at_position(it), "newName": "another"}, 20),
    "workspace/willRenameFiles": (
        "workspace.fileOperations.willRename",
        lambda it: {"files": [{"oldUri": it["textDocument"]["uri"], "newUri": it["textDocument"]["uri"].replace(".mal", "_2.mal")}]},
        400,
    ),
    "textDocument/documentSymbol": ("documentSymbolProvider", in_text, 200),
    "workspace/symbol": ("workspaceSymbolProvider", lambda _: {"query": "na"}, 10_000),
    "textDocument/foldingRange": ("foldingRangeProvider", in_text, 200),
    "textDocument/selectionRange": ("selectionRangeProvider", lambda it: {**in_text(it), "positions": [it["position"]] * 2}, 20),
    "textDocument/documentLink": ("documentLinkProvider", in_text, 200),
    "textDocument/codeLens": ("codeLensProvider", in_text, 200),
    "textDocument/codeAction": ("codeActionProvider", lambda it: {**at_range(it), "context": {"diagnostics": []}}, 40),
    "textDocument/inlayHint": ("inlayHintProvider", lambda it: {**in_text(it), "range": WHOLE}, 200),
    "textDocument/formatting": ("documentFormattingProvider", lambda it: {**in_text(it), **FORMATTING}, 200),
    "textDocument/rangeFormatting": ("documentRangeFormattingProvider", lambda it: {**at_range(it), **FORMATTING}, 5),
    # The brace that ends the text that is not in order.
    "textDocument/onTypeFormatting": (
        "documentOnTypeFormattingProvider",
        lambda it: {**in_text(it), "position": {"line": 3, "character": 1}, **FORMATTING, "ch": "}"},
        200,
    ),
    "textDocument/semanticTokens/full": ("semanticTokensProvider.full", in_text, 200),
    "textDocument/semanticTokens/range": ("semanticTokensProvider.range", at_range, 50),
    "textDocument/prepareCallHierarchy": ("callHierarchyProvider", at_position, 10),
    "textDocument/prepareTypeHierarchy": ("typeHierarchyProvider", at_position, 3),
    "textDocument/diagnostic": ("diagnosticProvider", in_text, 200),
    "workspace/diagnostic": ("diagnosticProvider.workspaceDiagnostics", lambda _: {"previousResultIds": []}, 10_000),
}


def resolved(answer, _):
    return items(answer)


def of_item(answer, _):
    return [{"item": item} for item in items(answer)]


def since(answer, place):
    return [{**in_text(place), "previousResultId": answer["resultId"]}] if answer and answer.get("resultId") else []


#: Requests that follow another one, and what they are asked with.
FOLLOWING = {
    "completionItem/resolve": ("textDocument/completion", "completionProvider.resolveProvider", resolved),
    "workspaceSymbol/resolve": ("workspace/symbol", "workspaceSymbolProvider.resolveProvider", resolved),
    "documentLink/resolve": ("textDocument/documentLink", "documentLinkProvider.resolveProvider", resolved),
    "codeAction/resolve": ("textDocument/codeAction", "codeActionProvider.resolveProvider", resolved),
    "inlayHint/resolve": ("textDocument/inlayHint", "inlayHintProvider.resolveProvider", resolved),
    "callHierarchy/incomingCalls": ("textDocument/prepareCallHierarchy", "callHierarchyProvider", of_item),
    "callHierarchy/outgoingCalls": ("textDocument/prepareCallHierarchy", "callHierarchyProvider", of_item),
    "typeHierarchy/supertypes": ("textDocument/prepareTypeHierarchy", "typeHierarchyProvider", of_item),
    "typeHierarchy/subtypes": ("textDocument/prepareTypeHierarchy", "typeHierarchyProvider", of_item),
    "textDocument/semanticTokens/full/delta": ("textDocument/semanticTokens/full", "semanticTokensProvider.full.delta", since),
}


async def test_initialize(session):
    said = [method for method, (provider, *_) in REQUESTS.items() if at(session.server, provider, False)]
    said += [method for method, (_, provider, _) in FOLLOWING.items() if at(session.server, provider, False)]
    left = sorted({*REQUESTS, *FOLLOWING} - set(said))
    print(f"asked: {', '.join(said)}")
    print(f"not asked, since the server does not announce it to this client: {', '.join(left)}")
    assert "textDocument/hover" in said


async def test_requests_all_over_the_robot(session):
    counts = {}
    for method, (provider, parameters, step) in REQUESTS.items():
        if not at(session.server, provider, False):
            continue
        following = [(name, make) for name, (other, own, make) in FOLLOWING.items() if other == method and at(session.server, own, False)]
        for place in session.places(step):
            answer = await session.ask(method, parameters(place))
            counts[method] = counts.get(method, 0) + bool(answer)
            for name, make in following:
                for some in make(answer, place)[:2]:
                    counts[name] = counts.get(name, 0) + bool(await session.ask(name, some))
    print(counts)
    # A request that is never answered by anything is not tested by this.
    empty = [method for method, count in counts.items() if count == 0]
    assert len(empty) <= (0 if "MAUVE_ALL" in os.environ else 3), f"nothing but empty answers: {empty}"


async def test_generated_packages(session):
    """As each client can have them: by an edit that it asks for, by one that it is told to make, or not at all."""
    if not at(session.server, "codeActionProvider"):
        print("not asked, since the server does not announce code actions to this client")
        return
    uri = (session.folder / "deployment.mal").as_uri()
    place = session.position(session.texts[uri], session.texts[uri].index("activity pose"))
    parameters = {"textDocument": {"uri": uri}, "range": {"start": place, "end": place}, "context": {"diagnostics": [], "only": ["source"]}}
    actions = [it for it in await session.ask("textDocument/codeAction", parameters) if it["kind"] == "source.generate.mauve"]
    assert len(actions) == 2, actions
    for action in actions:
        if action.get("data"):
            resolved = await session.ask("codeAction/resolve", action)
            changes = resolved["edit"]["documentChanges"]
            assert len(changes) > 20 and {it.get("kind") for it in changes} == {"create", None}
            print(f"{len(changes)} changes by the action")
        else:
            command = {name: action["command"][name] for name in ["command", "arguments"]}
            done = await session.ask("workspace/executeCommand", command)
            makes = session.client.protocol.conformance.announced("workspace.applyEdit")
            makes = makes and "create" in at(session.client.protocol.conformance.client, "workspace.workspaceEdit.resourceOperations", [])
            assert (done is not None) == makes
            print(f"by the command: {done}")


async def test_an_edited_text(session):
    uri = (session.folder / "deployment.mal").as_uri()
    session.change(uri, 2, "activity navigation", "/* \u00b5s \U0001d6d1 \u00e9 */ activity navigation")
    session.change(uri, 3, "deadline = 1000", "deadline = 700")
    codes = lambda: [it.code for it in session.client.diagnostics.get(uri, [])]
    if at(session.server, "diagnosticProvider") and session.client.protocol.conformance.announced("textDocument.diagnostic"):
        report = await session.ask("textDocument/diagnostic", {"textDocument": {"uri": uri}})
        found = report["items"]
        assert [it["code"] for it in found if it["severity"] < 4] == ["deadline-missed"]
    else:
        while "deadline-missed" not in codes():
            await session.client.wait_for_notification("textDocument/publishDiagnostics")
        found = CONVERTER.unstructure(session.client.diagnostics[uri])
    missed = next(it for it in found if it["code"] == "deadline-missed")
    text = session.texts[uri]
    start = text.index("activity navigation") + len("activity ")
    assert missed["range"]["start"] == session.position(text, start)
    if at(session.server, "codeActionProvider"):
        context = {"diagnostics": [missed]}
        await session.ask("textDocument/codeAction", {"textDocument": {"uri": uri}, "range": missed["range"], "context": context})
    session.change(uri, 4, "deadline = 700", "deadline = ")
    session.notify("textDocument/didSave", {"textDocument": {"uri": uri}, "text": session.texts[uri]})
    session.notify("textDocument/didClose", {"textDocument": {"uri": uri}})


async def test_half_typed(session):
    """Each request, where a text ends in the middle of something."""
    robot = (session.folder / "components" / "navigation.mal").read_text()
    for number, end in enumerate(range(100, len(robot), len(robot) // 12)):
        path = session.folder / f"half{number}.mal"
        uri = session.open(path, robot[:end] + "\u00e9\U0001f916 ")
        position = session.position(session.texts[uri], len(session.texts[uri]))
        place = {"textDocument": {"uri": uri}, "position": position, "range": {"start": position, "end": position}}
        for method, (provider, parameters, _) in REQUESTS.items():
            if at(session.server, provider, False):
                await session.ask(method, parameters(place))


async def test_settings_and_folders(session):
    session.notify("workspace/didChangeConfiguration", {"settings": {"mauve": {"timing": {"significance": 1e-3}}}})
    folder = {"uri": session.folder.as_uri(), "name": "p3dx"}
    session.notify("workspace/didChangeWorkspaceFolders", {"event": {"added": [], "removed": [folder]}})
    session.notify("workspace/didChangeWorkspaceFolders", {"event": {"added": [folder], "removed": []}})
    changed = {"uri": (session.folder / "mauve.toml").as_uri(), "type": 2}
    session.notify("workspace/didChangeWatchedFiles", {"changes": [changed]})
    uri = (session.folder / "deployment.mal").as_uri()
    assert await session.ask("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
