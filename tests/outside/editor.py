"""Every request of `hyd lsp`, asked by a client of other people (pytest-lsp on pygls), which warns of what the protocol does not allow."""
import asyncio
import os
import pathlib
import re
import shutil
import sys
import warnings

from lsprotocol import types as lsp
from pygls.protocol import default_converter
from pytest_lsp import LanguageClient, LspSpecificationWarning, client_capabilities

HYD, WORK = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve() / "editor"
LIBRARY, PLACE = WORK / "library", WORK / "workspace"
warnings.simplefilter("error", LspSpecificationWarning)

TEXTS = {
    LIBRARY / "Parts" / "package.hyd": "package Parts\nend Parts;\n",
    LIBRARY / "Parts" / "Gain.hyd": (
        "within Parts;\nfunction gain \"scales\"\n  input Real u \"what\";\n  input Real k = 2 \"how much\";\n  output Real y;\n"
        "algorithm\n  y := k*u;\nend gain;\n"),
    PLACE / "Drive" / "package.hyd": "package Drive\n  constant Real g(unit = \"m/s2\") = 9.81;\nend Drive;\n",
    PLACE / "Drive" / "Mass.hyd": (
        "within Drive;\npartial model Mass\n  parameter Real m(unit = \"kg\") = 1 \"mass\";\nend Mass;\n"),
    PLACE / "Drive" / "Ball.hyd": (
        "within Drive;\nmodel Ball \"falls 𝄞 freely\"\n  extends Mass(m = 2);\n  Real x(start = 1, fixed = true, unit = \"m\");\n"
        "  Real v(start = 0, fixed = true);\n  parameter Real w = 2*m*g;\nequation\n  der(x) = v;\n  m*der(v) = -w/2;\nend Ball;\n"),
    PLACE / "use.hyd": (
        "model Use\n  Drive.Ball ball(m = 3);\n  Real twice = 2*ball.x;\nend Use;\n"),
}


def uri(path):
    return path.resolve().as_uri()


def at(text, word, offset=0, nth=0):
    """The position of a word, columns in UTF-16."""
    byte = [found.start() for found in re.finditer(re.escape(word), text)][nth] + offset
    line = text.count("\n", 0, byte)
    column = text[text.rfind("\n", 0, byte) + 1:byte]
    return lsp.Position(line, len(column.encode("utf-16-le")) // 2)


class Editor:
    def __init__(self, client):
        self.client, self.versions, self.texts = client, {}, {}

    async def settled(self, path, version):
        """The messages of a state of a document."""
        while True:
            known = self.client.published.get(uri(path))
            if known and known.version == version:
                return list(known.diagnostics)
            await asyncio.wait_for(self.client.news.wait(), 30)
            self.client.news.clear()

    async def open(self, path, text=None):
        text = path.read_text() if text is None else text
        self.versions[path], self.texts[path] = 1, text
        item = lsp.TextDocumentItem(uri=uri(path), language_id="hyd", version=1, text=text)
        self.client.text_document_did_open(lsp.DidOpenTextDocumentParams(text_document=item))
        return await self.settled(path, 1)

    async def change(self, path, old, new, nth=0):
        text = self.texts[path]
        span = lsp.Range(at(text, old, nth=nth), at(text, old, len(old), nth=nth))
        places = [found.start() for found in re.finditer(re.escape(old), text)]
        self.texts[path] = text[:places[nth]] + new + text[places[nth] + len(old):]
        self.versions[path] += 1
        change = lsp.TextDocumentContentChangePartial(range=span, text=new)
        document = lsp.VersionedTextDocumentIdentifier(uri=uri(path), version=self.versions[path])
        params = lsp.DidChangeTextDocumentParams(text_document=document, content_changes=[change])
        self.client.text_document_did_change(params)
        return await self.settled(path, self.versions[path])

    def place(self, path, word, offset=0, nth=0):
        position = at(self.texts[path], word, offset, nth)
        return {"text_document": lsp.TextDocumentIdentifier(uri=uri(path)), "position": position}

    def document(self, path):
        return {"text_document": lsp.TextDocumentIdentifier(uri=uri(path))}


def snippet(path, span, text=None):
    """What a range of a file holds."""
    lines = (text or path.read_text()).split("\n")
    if span.start.line != span.end.line:
        return None
    encoded = lines[span.start.line].encode("utf-16-le")
    return encoded[2 * span.start.character:2 * span.end.character].decode("utf-16-le")


def applied(text, edits):
    """A text after edits, by UTF-16 columns."""
    def offset(position):
        lines = text.split("\n")
        before = sum(len(line) + 1 for line in lines[:position.line])
        return before + len(lines[position.line].encode("utf-16-le")[:2 * position.character].decode("utf-16-le"))
    for edit in sorted(edits, key=lambda edit: offset(edit.range.start), reverse=True):
        text = text[:offset(edit.range.start)] + edit.new_text + text[offset(edit.range.end):]
    return text


async def start(capabilities, options):
    client = LanguageClient(converter_factory=default_converter)
    client.published, client.news, client.logged = {}, asyncio.Event(), []

    @client.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
    def _(params):
        client.published[params.uri] = params
        client.news.set()

    @client.feature(lsp.WINDOW_LOG_MESSAGE)
    def _(params):
        client.logged.append(params)

    @client.feature(lsp.WINDOW_SHOW_DOCUMENT)
    def _(_params):
        return lsp.ShowDocumentResult(success=True)

    @client.feature(lsp.CLIENT_REGISTER_CAPABILITY)
    def _(_params):
        return None

    @client.feature(lsp.WORKSPACE_INLAY_HINT_REFRESH)
    def _(_params):
        return None

    await client.start_io(str(HYD), "lsp")
    folder = lsp.WorkspaceFolder(uri=uri(PLACE), name="workspace")
    params = lsp.InitializeParams(capabilities=capabilities, workspace_folders=[folder], initialization_options=options)
    return client, (await client.initialize_session(params)).capabilities


async def questions(editor, client):
    ball, use = PLACE / "Drive" / "Ball.hyd", PLACE / "use.hyd"
    assert await editor.open(ball) == []

    hover = await client.text_document_hover_async(lsp.HoverParams(**editor.place(ball, "m*der", 0)))
    said = hover.contents.value
    assert "parameter Real m" in said and "`kg`" in said and "`2`, modified in `Drive.Ball` (Ball.hyd:3)" in said, said
    assert "m·dv/dt = −w/2" in said, said
    hover = await client.text_document_hover_async(lsp.HoverParams(**editor.place(ball, "Mass")))
    assert "partial model Drive.Mass" in hover.contents.value and snippet(ball, hover.range) == "Mass"

    found = await client.text_document_definition_async(lsp.DefinitionParams(**editor.place(ball, "g;")))
    assert [(one.uri, snippet(PLACE / "Drive" / "package.hyd", one.range)) for one in found] == [
        (uri(PLACE / "Drive" / "package.hyd"), "g")]
    found = await client.text_document_declaration_async(lsp.DeclarationParams(**editor.place(ball, "Ball", nth=0)))
    assert [snippet(PLACE / "Drive" / "Mass.hyd", one.range) for one in found] == ["Mass"]
    # A class of the built-in library is a file that can be opened.
    await editor.open(use, TEXTS[use].replace("Real twice", "Hyd.Units.Length twice"))
    found = await client.text_document_definition_async(lsp.DefinitionParams(**editor.place(use, "Length")))
    laid_down = pathlib.Path(re.sub("^file://", "", found[0].uri))
    assert snippet(laid_down, found[0].range) == "Length"
    found = await client.text_document_type_definition_async(lsp.TypeDefinitionParams(**editor.place(use, "ball", nth=0)))
    assert [snippet(ball, one.range) for one in found] == ["Ball"]

    await editor.change(use, "2*ball.x", "2*ball.")
    done = await client.text_document_completion_async(lsp.CompletionParams(**editor.place(use, "ball.", 5)))
    assert {item.label for item in done.items} == {"m", "x", "v", "w"}
    await editor.change(use, "(m = 3)", "()")
    done = await client.text_document_completion_async(lsp.CompletionParams(**editor.place(use, "()", 1)))
    assert [item.label for item in sorted(done.items, key=lambda item: item.sort_text)][:2] == ["m", "w"]
    await editor.change(use, "()", "(x(unit = \"\"))")
    done = await client.text_document_completion_async(lsp.CompletionParams(**editor.place(use, "\"\"", 1)))
    assert "kg/m3" in {item.label for item in done.items}
    await editor.change(use, "(x(unit = \"\"))", "(m = 3)")
    await editor.change(use, "2*ball.", "Parts.gain(ball.x, k = 3)")
    done = await client.text_document_completion_async(lsp.CompletionParams(**editor.place(use, "Parts.", 6)))
    assert "gain" in {item.label.lower() for item in done.items}
    help_ = await client.text_document_signature_help_async(lsp.SignatureHelpParams(**editor.place(use, "k = 3", 4)))
    [signature] = help_.signatures
    assert signature.label == "Parts.gain(Real u, Real k = 2)" and help_.active_parameter == 1

    found = await client.text_document_document_highlight_async(lsp.DocumentHighlightParams(**editor.place(ball, "w =")))
    assert [snippet(ball, one.range) for one in found] == ["w", "w"]
    context = lsp.ReferenceContext(include_declaration=True)
    found = await client.text_document_references_async(lsp.ReferenceParams(**editor.place(ball, "x(start"), context=context))
    assert sorted((one.uri, one.range.start.line) for one in found) == sorted([(uri(ball), 3), (uri(ball), 7), (uri(use), 2)])

    span = await client.text_document_prepare_rename_async(lsp.PrepareRenameParams(**editor.place(ball, "x(start")))
    assert snippet(ball, span) == "x"
    edit = await client.text_document_rename_async(lsp.RenameParams(**editor.place(ball, "x(start"), new_name="height"))
    changed = {change.text_document.uri: applied(editor.texts[path], change.edits)
               for change in edit.document_changes for path in (ball, use) if uri(path) == change.text_document.uri}
    assert "der(height) = v" in changed[uri(ball)] and "ball.height" in changed[uri(use)], changed
    edit = await client.text_document_rename_async(lsp.RenameParams(**editor.place(ball, "Ball", nth=0), new_name="Stone"))
    *edits, renaming = edit.document_changes
    assert renaming.kind == "rename" and renaming.new_uri.endswith("/Stone.hyd")
    assert sorted(len(change.edits) for change in edits) == [1, 2]
    for word, name in [("x(start", "2x"), ("x(start", "v"), ("g;", "end")]:
        try:
            await client.text_document_rename_async(lsp.RenameParams(**editor.place(ball, word), new_name=name))
        except Exception as refusal:
            assert name in str(refusal)
        else:
            raise AssertionError(f"{name} is no new name for {word}")

    tree = await client.text_document_document_symbol_async(lsp.DocumentSymbolParams(**editor.document(ball)))
    assert [(top.name, [inner.name for inner in top.children]) for top in tree] == [("Ball", ["x", "v", "w"])]
    found = await client.workspace_symbol_async(lsp.WorkspaceSymbolParams(query="mas"))
    assert [(one.name, one.container_name) for one in found] == [("Mass", "Drive")]

    tokens = await client.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(**editor.document(ball)))
    legend = client.legend.token_types
    line = start = 0
    seen = []
    for k in range(0, len(tokens.data), 5):
        down, right, length, kind, _ = tokens.data[k:k + 5]
        line, start = line + down, (start if down == 0 else 0) + right
        span = lsp.Range(lsp.Position(line, start), lsp.Position(line, start + length))
        seen.append((snippet(ball, span), legend[kind]))
    assert ("Ball", "class") in seen and ("m", "parameter") in seen and ("\"falls 𝄞 freely\"", "string") in seen, seen
    assert ("der", "keyword") in seen and ("x", "variable") in seen and ("start", "property") in seen, seen
    whole = lsp.Range(lsp.Position(3, 0), lsp.Position(4, 0))
    part = await client.text_document_semantic_tokens_range_async(
        lsp.SemanticTokensRangeParams(**editor.document(ball), range=whole))
    assert 0 < len(part.data) < len(tokens.data)
    folds = await client.text_document_folding_range_async(lsp.FoldingRangeParams(**editor.document(ball)))
    assert [(fold.start_line, fold.end_line) for fold in folds] == [(1, 8), (6, 8)]

    everything = lsp.Range(lsp.Position(0, 0), lsp.Position(99, 0))
    hints = await client.text_document_inlay_hint_async(lsp.InlayHintParams(**editor.document(ball), range=everything))
    assert {(hint.position.line, hint.label) for hint in hints} >= {(4, "[m/s]"), (5, "= 39.24"), (7, "→ der(x)"), (8, "→ der(v)")}, hints
    lenses = await client.text_document_code_lens_async(lsp.CodeLensParams(**editor.document(ball)))
    assert [lens.command.title for lens in lenses] == ["simulate", "plot", "equations"]
    text = await client.workspace_execute_command_async(
        lsp.ExecuteCommandParams(command="hyd.server.equations", arguments=[uri(ball), "Ball"]))
    assert "der(x)" in text
    text = await client.workspace_execute_command_async(
        lsp.ExecuteCommandParams(command="hyd.server.explain", arguments=["E0201"]))
    assert text.startswith("E0201: unknown name")


async def messages(editor, client):
    ball, mass, use = PLACE / "Drive" / "Ball.hyd", PLACE / "Drive" / "Mass.hyd", PLACE / "use.hyd"
    [wrong] = await editor.change(ball, "-w/2", "-ww/2")
    assert (wrong.code, snippet(ball, wrong.range, editor.texts[ball])) == ("E0201", "ww")
    assert wrong.data == {"explain": "hyd explain E0201"}
    context = lsp.CodeActionContext(diagnostics=[wrong])
    [fix] = [action for action in await client.text_document_code_action_async(
        lsp.CodeActionParams(**editor.document(ball), range=wrong.range, context=context)) if action.kind == "quickfix"]
    [edits] = fix.edit.changes.values()
    assert applied(editor.texts[ball], edits) == TEXTS[ball]
    assert await editor.change(ball, "-ww/2", "-w/2") == []
    # Units, and the numbers of equations and unknowns.
    [wrong] = await editor.change(ball, "der(x) = v", "der(x) = v*x")
    assert wrong.code == "E0301" and wrong.related_information, wrong
    assert await editor.change(ball, "der(x) = v*x", "der(x) = v") == []
    wrong = await editor.change(ball, "  der(x) = v;\n", "")
    assert any(one.code == "E0401" for one in wrong), wrong
    assert await editor.change(ball, "equation\n", "equation\n  der(x) = v;\n") == []
    # A neighbour that is not saved counts.
    await editor.open(mass)
    await editor.change(mass, " m(", " mm(")
    for _ in range(100):
        if client.published[uri(ball)].diagnostics:
            break
        await asyncio.sleep(0.1)
    assert {one.code for one in client.published[uri(ball)].diagnostics} <= {"E0201", "E0203"} and client.published[uri(ball)].diagnostics
    await editor.change(mass, " mm(", " m(")
    # Half a line, and a file that vanishes.
    assert any(one.code == "E0101" for one in await editor.change(ball, "der(x) = v;", "der(x) = "))
    await editor.change(ball, "der(x) = ", "der(x) = v;")
    await editor.settled(use, editor.versions[use])
    mass.unlink()
    client.text_document_did_close(lsp.DidCloseTextDocumentParams(**editor.document(mass)))
    wrong = await editor.change(ball, "Mass(m = 2)", "Mass(m = 2.0)")
    assert [one.code for one in wrong][:1] == ["E0202"], wrong
    mass.write_text(TEXTS[mass])
    assert await editor.change(ball, "Mass(m = 2.0)", "Mass(m = 2)") == []

    # The layout, of all and of a line.
    await editor.change(ball, "  m*der(v) = -w/2;", "    m * der(v)=-w/2;")
    await editor.change(ball, "  der(x) = v;", "der(x)=v;")
    options = lsp.FormattingOptions(tab_size=2, insert_spaces=True)
    edits = await client.text_document_formatting_async(lsp.DocumentFormattingParams(**editor.document(ball), options=options))
    assert applied(editor.texts[ball], edits) == TEXTS[ball]
    line = lsp.Range(lsp.Position(7, 2), lsp.Position(7, 5))
    edits = await client.text_document_range_formatting_async(
        lsp.DocumentRangeFormattingParams(**editor.document(ball), range=line, options=options))
    assert applied(editor.texts[ball], edits) == editor.texts[ball].replace("der(x)=v", "  der(x) = v")


async def main():
    shutil.rmtree(WORK, ignore_errors=True)
    os.environ["XDG_CACHE_HOME"] = str(WORK / "cache")
    for path, text in TEXTS.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    commands = ["hyd.simulate", "hyd.plot", "hyd.equations"]
    options = {"library": [str(LIBRARY)], "commands": commands}
    client, able = await start(client_capabilities("visual-studio-code"), options)
    client.legend = able.semantic_tokens_provider.legend
    assert able.position_encoding == "utf-16"
    editor = Editor(client)
    await questions(editor, client)
    await messages(editor, client)
    # What is unknown, and what cannot be understood, is refused and not met with silence.
    nowhere = lsp.HoverParams(lsp.TextDocumentIdentifier(uri="file:///nowhere.hyd"), lsp.Position(0, 0))
    for method, params in [("textDocument/hover", nowhere), ("textDocument/unheardOf", {})]:
        try:
            await client.protocol.send_request_async(method, params)
        except Exception:
            continue
        raise AssertionError(method)
    await client.shutdown_session()
    assert not client.logged, client.logged

    # Columns in bytes, where the client offers them.
    able = client_capabilities("visual-studio-code")
    able.general.position_encodings = ["utf-8", "utf-16"]
    client, able = await start(able, {"library": [str(LIBRARY)]})
    assert able.position_encoding == "utf-8"
    editor = Editor(client)
    await editor.open(PLACE / "Drive" / "Ball.hyd", "model M \"𝄞\" Real x = y; end M;")
    [wrong] = await editor.settled(PLACE / "Drive" / "Ball.hyd", 1)
    assert (wrong.range.start.character, wrong.range.end.character) == (24, 25), wrong.range
    await client.shutdown_session()


asyncio.run(main())
print("hyd lsp: every request is answered as a client of other people expects it")
