// Starts `teachtree lsp` and hands it the open files; all that is known is known there.
"use strict";

const { workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

exports.activate = async () => {
  const settings = workspace.getConfiguration("teachtree");
  const { log, at, binding, scene, hand, command } = settings;
  client = new LanguageClient(
    "teachtree",
    { command, args: ["lsp"] },
    {
      documentSelector: [
        { language: "teachtree", scheme: "file" },
        { language: "teachtree", scheme: "untitled" },
        { language: "yaml", scheme: "file", pattern: "**/*.{scene,operator,binding,robot}.yaml" },
      ],
      initializationOptions: { log, at, binding, scene, hand },
      // Settings go over when they change, and so does what happens to rule files on disk.
      synchronize: {
        configurationSection: "teachtree",
        fileEvents: workspace.createFileSystemWatcher("**/*.rules"),
      },
    },
  );
  await client.start();
};

exports.deactivate = () => client?.stop();
