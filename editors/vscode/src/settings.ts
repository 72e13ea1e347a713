import * as vscode from "vscode";

const PATH = "mauve.server.path";

/**
 * Opens the setting of the server's path in the tab that has the value in effect: the workspace's, or that of the machine
 * where the extension runs.
 */
export async function openServerSetting(): Promise<void> {
  const value = vscode.workspace.getConfiguration().inspect<string>(PATH);
  const isInWorkspace = value?.workspaceValue !== undefined || value?.workspaceFolderValue !== undefined;
  // Machine settings of a remote window are not the user's own: VS Code ignores a path there.
  const isRemote = vscode.env.remoteName !== undefined;
  const command = isInWorkspace ? "openWorkspaceSettings" : isRemote ? "openRemoteSettings" : "openGlobalSettings";
  await vscode.commands.executeCommand(`workbench.action.${command}`, { query: `@id:${PATH}` });
}
