// The extension: starts `hyd lsp`, and runs the program for what an editor does not compute.
const fs = require("fs");
const os = require("os");
const path = require("path");
const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

function settings() {
  return vscode.workspace.getConfiguration("hyd");
}

function options() {
  const own = settings();
  return {
    library: own.get("library", []),
    strictUnits: own.get("strictUnits", false),
    allowOutside: own.get("allowOutside", false),
    commands: ["hyd.simulate", "hyd.plot", "hyd.equations"],
  };
}

async function start() {
  const program = settings().get("path", "hyd");
  const run = { command: program, args: ["lsp"] };
  client = new LanguageClient("hyd", "hyd", { run, debug: run }, {
    documentSelector: [{ language: "hyd" }],
    initializationOptions: options(),
    synchronize: { configurationSection: "hyd" },
    // The one thing that the server wants shown are equations, which the extension shows itself.
    middleware: { window: { showDocument: async () => ({ success: true }) } },
  });
  try {
    await client.start();
  } catch (error) {
    client = undefined;
    const open = "Open the settings";
    const sentence = `\`${program} lsp\` cannot be started: ${error.message || error}`;
    if ((await vscode.window.showErrorMessage(sentence, open)) === open) {
      vscode.commands.executeCommand("workbench.action.openSettings", "hyd.path");
    }
  }
}

async function stop() {
  const running = client;
  client = undefined;
  if (running) {
    await running.stop();
  }
}

// The document and the class that a command is for: those of a lens, else those at the cursor.
async function model(uri, name) {
  if (uri && name) {
    const document = await vscode.workspace.openTextDocument(vscode.Uri.parse(uri));
    return { document, name };
  }
  const editor = vscode.window.activeTextEditor;
  if (!editor || editor.document.languageId !== "hyd") {
    vscode.window.showInformationMessage("No model is open in the editor.");
    return undefined;
  }
  const lenses = await vscode.commands.executeCommand("vscode.executeCodeLensProvider", editor.document.uri, 100);
  const known = (lenses || []).filter((lens) => lens.command && lens.command.command === "hyd.simulate");
  const before = known.filter((lens) => lens.range.start.line <= editor.selection.active.line);
  const chosen = before[before.length - 1] || known[0];
  if (!chosen) {
    vscode.window.showInformationMessage("This file holds no complete model.");
    return undefined;
  }
  return { document: editor.document, name: chosen.command.arguments[1] };
}

// Arguments that lead the program to what the server sees.
function libraries(folder) {
  const root = folder ? folder.uri.fsPath : undefined;
  const named = settings().get("library", []).map((one) => (root ? path.resolve(root, one) : one));
  const all = root ? [...named, root] : named;
  const flags = all.flatMap((one) => ["--library", one]);
  return settings().get("allowOutside", false) ? [...flags, "--allow-outside"] : flags;
}

// Runs the program as a task, whose messages become problems.
async function run(verb, chosen, more) {
  if (chosen.document.isDirty && !(await chosen.document.save())) {
    return undefined;
  }
  const file = chosen.document.uri.fsPath;
  return task(`${verb} ${chosen.name}`, chosen.document.uri, [verb, file, "--model", chosen.name], more);
}

// Runs the program in the folder of a file; gives its exit code.
async function task(title, uri, words, more) {
  const folder = vscode.workspace.getWorkspaceFolder(uri);
  const all = [...words, ...libraries(folder), ...more];
  const execution = new vscode.ProcessExecution(settings().get("path", "hyd"), all, { cwd: path.dirname(uri.fsPath) });
  const scope = folder || vscode.TaskScope.Workspace;
  const task = new vscode.Task({ type: "process" }, scope, title, "hyd", execution, ["$hyd"]);
  task.presentationOptions = { clear: true, reveal: vscode.TaskRevealKind.Always };
  const started = await vscode.tasks.executeTask(task);
  return new Promise((resolve) => {
    const listener = vscode.tasks.onDidEndTaskProcess((ended) => {
      if (ended.execution === started) {
        listener.dispose();
        resolve(ended.exitCode);
      }
    });
  });
}

async function simulate(uri, name) {
  const chosen = await model(uri, name);
  return chosen && run("simulate", chosen, []);
}

async function plot(uri, name) {
  const chosen = await model(uri, name);
  if (!chosen) {
    return;
  }
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "hyd-plot-"));
  const picture = path.join(folder, `${chosen.name.split(".").pop()}.png`);
  const names = await vscode.window.showInputBox({
    prompt: "Variables to draw, as a regular expression for their full names; nothing for all",
  });
  if (names === undefined) {
    return;
  }
  const wanted = names.trim() ? ["--variables", names.trim()] : [];
  const code = await run("simulate", chosen, ["--plot", picture, ...wanted]);
  if (code === 0 && fs.existsSync(picture)) {
    await vscode.commands.executeCommand("vscode.open", vscode.Uri.file(picture), vscode.ViewColumn.Beside);
  }
}

// Texts that the server has given, by title: they can be read and copied, and nothing asks to save them.
const SCHEME = "hyd-text";
const texts = new Map();
const renewed = new vscode.EventEmitter();
const reader = { onDidChange: renewed.event, provideTextDocumentContent: (uri) => texts.get(uri.path) };

async function show(content, title) {
  const uri = vscode.Uri.from({ scheme: SCHEME, path: `/${title}` });
  texts.set(uri.path, content);
  renewed.fire(uri);
  const document = await vscode.workspace.openTextDocument(uri);
  await vscode.window.showTextDocument(document, { viewColumn: vscode.ViewColumn.Beside, preview: true });
}

// What the server answers to one of its commands.
async function asked(command, words) {
  if (!client) {
    vscode.window.showErrorMessage("`hyd lsp` is not running.");
    return undefined;
  }
  try {
    return await client.sendRequest("workspace/executeCommand", { command, arguments: words });
  } catch (error) {
    vscode.window.showErrorMessage(error.message || String(error));
    return undefined;
  }
}

async function equations(uri, name) {
  const chosen = await model(uri, name);
  if (!chosen) {
    return;
  }
  const text = await asked("hyd.server.equations", [chosen.document.uri.toString(), chosen.name]);
  if (text) {
    await show(text, `${chosen.name} (equations)`);
  }
}

async function explain(code) {
  const editor = vscode.window.activeTextEditor;
  const here = editor && vscode.languages.getDiagnostics(editor.document.uri).find((one) => (
    one.source === "hyd" && one.range.contains(editor.selection.active)
  ));
  const wanted = code || await vscode.window.showInputBox({ prompt: "A code, such as E0201", value: here && String(here.code) });
  const text = wanted && await asked("hyd.server.explain", [wanted]);
  if (text) {
    await show(text, wanted);
  }
}

// The page of a model with sliders, at the address that the terminal shows, until the task is ended.
async function view(uri, name) {
  const chosen = await model(uri, name);
  return chosen && run("view", chosen, []);
}

// Files below the workspace whose text holds a mark, for a choice; the one that is open in the editor comes first.
async function candidates(pattern, mark) {
  const found = await vscode.workspace.findFiles(pattern, "**/{node_modules,target}/**", 500);
  const editor = vscode.window.activeTextEditor, open = editor && editor.document.uri.fsPath;
  const holds = (uri) => {
    try {
      return mark.test(fs.readFileSync(uri.fsPath, "utf8"));
    } catch {
      // A file that has gone meanwhile is none.
      return false;
    }
  };
  const items = found.filter(holds).map((uri) => ({ label: vscode.workspace.asRelativePath(uri), uri }));
  const isOpen = (item) => Number(item.uri.fsPath === open);
  return items.sort((a, b) => isOpen(b) - isOpen(a) || a.label.localeCompare(b.label));
}

async function choice(items, placeHolder, missing) {
  if (items.length === 0) {
    vscode.window.showInformationMessage(missing);
    return undefined;
  }
  return vscode.window.showQuickPick(items, { placeHolder });
}

// What a model lacks: a search with a study and a set of shots, and its report.
async function discover() {
  const studies = await candidates("**/*.toml", /^\s*\[channels\]/m);
  const study = await choice(studies, "The study: which model, which channel is which variable",
    "There is no study here: a .toml file that says which channel of a bench is which variable of a model.");
  if (!study) {
    return;
  }
  const sets = await candidates("**/*.json", /"experiments"\s*:/);
  const set = await choice(sets, "The set of shots", "There is no set of shots here: `hyd bench import` makes one of a folder of data.");
  if (!set) {
    return;
  }
  const folder = await vscode.window.showInputBox({
    prompt: "The folder of the report, beside the set", value: `${path.basename(set.uri.fsPath, ".json")}_report`,
  });
  if (!folder || !(await vscode.workspace.saveAll())) {
    return;
  }
  const target = path.resolve(path.dirname(set.uri.fsPath), folder);
  const words = ["discover", study.uri.fsPath, "--bench", set.uri.fsPath, "--report", target];
  const code = await task(`discover ${set.label}`, study.uri, words, []);
  const page = path.join(target, "report.html");
  const open = "Open the report";
  if (code === 0 && fs.existsSync(page) && (await vscode.window.showInformationMessage("The search has ended.", open)) === open) {
    await vscode.env.openExternal(vscode.Uri.file(page));
  }
}

async function report() {
  const found = await vscode.workspace.findFiles("**/report.html", "**/node_modules/**", 100);
  const items = found.map((uri) => ({ label: vscode.workspace.asRelativePath(uri), uri }));
  if (items.length === 0) {
    vscode.window.showInformationMessage("There is no report here: `hyd discover` writes one.");
    return;
  }
  const chosen = items.length === 1 ? items[0] : await vscode.window.showQuickPick(items);
  if (chosen) {
    await vscode.env.openExternal(chosen.uri);
  }
}

async function activate(context) {
  context.subscriptions.push(vscode.workspace.registerTextDocumentContentProvider(SCHEME, reader));
  const commands = { simulate, plot, view, equations, explain, discover, report };
  for (const [name, command] of Object.entries(commands)) {
    context.subscriptions.push(vscode.commands.registerCommand(`hyd.${name}`, command));
  }
  context.subscriptions.push(vscode.commands.registerCommand("hyd.restart", async () => {
    await stop();
    await start();
  }));
  context.subscriptions.push(vscode.workspace.onDidChangeConfiguration(async (change) => {
    if (change.affectsConfiguration("hyd.path")) {
      await stop();
      await start();
    }
  }));
  await start();
}

module.exports = { activate, deactivate: stop };
