// SPDX-License-Identifier: MIT
// What is wrong with a command line, said the way all other errors are: where, what was expected, what was found, and
// what was probably meant.
#pragma once

#include "relume/result.h"
#include "tools/base/option_rules.h"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace relume {

// What a command line that asks for what cannot be ends with.
inline Error usage(std::string message) { return {ErrorCode::usage, std::move(message)}; }

// One sentence for an error that parsing with `app` has thrown, which ends in where help is. given: of
// applyOptionRules().
std::string usageMessage(const CLI::App& app, const CLI::ParseError& error, const GivenTexts& given);

// The word of `known` that `word` was probably meant to be: it begins one of them, or is few edits (letters added,
// dropped, changed, swapped) away from it; empty when none is near.
std::string closestWord(std::string_view word, const std::vector<std::string>& known);

}  // namespace relume
