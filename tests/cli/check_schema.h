// SPDX-License-Identifier: MIT
// As much of JSON Schema as the published schemas use: type, const, enum, properties, required, additionalProperties,
// items, minItems, maxItems, $ref to $defs. Unknown keywords are errors, so that no rule is skipped in silence.
#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace relume {

class SchemaCheck {
 public:
  explicit SchemaCheck(nlohmann::json schema) : root_(std::move(schema)) {}

  // One line a violation, with its path.
  std::vector<std::string> check(const nlohmann::json& value) {
    errors_.clear();
    visit(root_, value, "$");
    return errors_;
  }

 private:
  using Json = nlohmann::json;

  static bool hasType(const Json& value, const std::string& type) {
    return (type == "object" && value.is_object()) || (type == "array" && value.is_array()) ||
           (type == "string" && value.is_string()) || (type == "number" && value.is_number()) ||
           (type == "integer" && value.is_number_integer()) || (type == "boolean" && value.is_boolean()) ||
           (type == "null" && value.is_null());
  }
  void fail(const std::string& path, const std::string& what) { errors_.push_back(path + ": " + what); }

  void visit(const Json& schema, const Json& value, const std::string& path) {
    for (const auto& [keyword, rule] : schema.items()) {
      if (keyword == "$ref") {
        visit(root_.at(Json::json_pointer(rule.get<std::string>().substr(1))), value, path);
      } else if (keyword == "type") {
        bool any = false;
        for (const Json& type : rule.is_array() ? rule : Json::array({rule})) any = any || hasType(value, type);
        if (!any) fail(path, "is " + std::string(value.type_name()) + ", expected " + rule.dump());
      } else if (keyword == "const") {
        if (value != rule) fail(path, "expected " + rule.dump());
      } else if (keyword == "enum") {
        if (std::find(rule.begin(), rule.end(), value) == rule.end())
          fail(path, value.dump() + " is none of " + rule.dump());
      } else if (keyword == "required") {
        for (const Json& name : rule) {
          if (!value.contains(name.get<std::string>())) fail(path, "lacks " + name.dump());
        }
      } else if (keyword == "properties") {
        for (const auto& [name, property] : rule.items()) {
          if (value.is_object() && value.contains(name)) visit(property, value[name], path + "." + name);
        }
      } else if (keyword == "additionalProperties") {
        for (const auto& [name, unused] : value.items()) {
          if (value.is_object() && !schema.at("properties").contains(name)) fail(path, "does not know " + name);
        }
      } else if (keyword == "items") {
        for (std::size_t i = 0; value.is_array() && i < value.size(); ++i)
          visit(rule, value[i], path + "[" + std::to_string(i) + "]");
      } else if (keyword == "minItems" || keyword == "maxItems") {
        if (value.is_array() && (keyword == "minItems" ? value.size() < rule : value.size() > rule))
          fail(path, keyword + " " + rule.dump());
      } else if (keyword != "$schema" && keyword != "$id" && keyword != "$defs" && keyword != "title" &&
                 keyword != "description") {
        fail(path, "the schema uses " + keyword + ", which this check does not know");
      }
    }
  }

  Json root_;
  std::vector<std::string> errors_;
};

}  // namespace relume
