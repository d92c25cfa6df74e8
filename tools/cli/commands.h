// SPDX-License-Identifier: MIT
// The subcommands of `relume`. Each lives in one command_<name>.cpp, which declares its options on a subcommand of
// `app` and sets `action` from the subcommand's callback:
//
//   void addThingCommand(CLI::App& app, Action& action) {
//     CLI::App* command = app.add_subcommand("thing", "Do the thing");
//     auto arguments = std::make_shared<ThingArguments>();
//     command->add_option("SCENE", arguments->scene, "glTF scene (.glb, .gltf)")->required();
//     command->callback([arguments, &action] { action = [arguments] { return runThing(*arguments); }; });
//   }
//
// runThing() returns the exit status: 0, exitCode(error.code), or kDifferenceFound; main.cpp turns what a
// signal has cancelled into kCancelled. To add a command: a declaration
// here, a call in main.cpp, a source file in CMakeLists.txt.
#pragma once

#include "relume/result.h"

#include <functional>

namespace CLI {
class App;
}

namespace relume {

inline constexpr int kDifferenceFound = 7;
inline constexpr int kCancelled = 130;  // by Ctrl-C, SIGTERM or SIGHUP, as shells have it

// What the chosen subcommand does once all arguments are parsed; returns the exit status.
using Action = std::function<int()>;

void addBakeCommand(CLI::App& app, Action& action);
void addMergeCommand(CLI::App& app, Action& action);
void addStoreCommand(CLI::App& app, Action& action);
void addBenchCommand(CLI::App& app, Action& action);
void addInfoCommand(CLI::App& app, Action& action);
void addValidateCommand(CLI::App& app, Action& action);
void addCompareCommand(CLI::App& app, Action& action);
void addStatusCommand(CLI::App& app, Action& action);
void addExportCommand(CLI::App& app, Action& action);
void addPackCommand(CLI::App& app, Action& action);
void addRenderCommand(CLI::App& app, Action& action);
void addPreviewCommand(CLI::App& app, Action& action);
void addReferenceCommand(CLI::App& app, Action& action);
void addDiffCommand(CLI::App& app, Action& action);
void addCompletionCommand(CLI::App& app, Action& action);
void addPagesCommand(CLI::App& app, Action& action);

// Prints "relume: error: <message>" to stderr; returns the exit status that belongs to the error.
int fail(const Error& error);

}  // namespace relume
