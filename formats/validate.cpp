// SPDX-License-Identifier: MIT
// See validate.h. The checks are in check_structure.cpp, check_values.cpp and check_transport.cpp.
#include "formats/validate.h"

#include "formats/findings.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {
namespace {

const ValidationMessage& messageOf(Check check) {
  for (const ValidationMessage& message : kValidationMessages) {
    if (message.check == check) return message;
  }
  return kValidationMessages[0];  // unreachable: a test holds the table complete
}

void checkProvenance(const Bake& bake, Findings& findings) {
  if (bake.provenance.optionsJson.empty()) findings.add(Check::optionsMissing, "provenance", "JSON", "nothing");
  if (bake.provenance.toolVersion.empty())
    findings.add(Check::toolVersionMissing, "provenance", "a semantic version", "nothing");
  for (std::size_t i = 0; i < bake.instances.size(); ++i) {
    if (bake.instances[i].node.empty()) findings.add(Check::instanceUnnamed, At{"instances", i}, "a name", "nothing");
  }
}

void checkCertificateValues(const Bake& bake, Findings& findings) {
  const Certificate& c = bake.certificate;
  const auto each = [&](const Array<float>& values, const char* name, const char* expected, float least) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!(std::isfinite(values[i]) && values[i] >= least))
        findings.add(Check::certificateNumber, At{name, i}, expected, values[i]);
    }
  };
  each(c.squaredError, "cert.error", "a finite number", -std::numeric_limits<float>::max());
  each(c.standardError, "cert.deviation", "0 or more", 0.0f);
  each(c.partError, "cert.part", "a finite number", -std::numeric_limits<float>::max());
  for (std::size_t i = 0; i < c.lightKind.size(); ++i) {
    if (c.lightKind[i] > static_cast<std::uint32_t>(TestLightKind::lamp))
      findings.add(Check::certificateNumber, At{"cert.kind", i}, "0 to 2", c.lightKind[i]);
  }
}

}  // namespace

void Findings::insert(Check check, std::string where, std::string expected, std::string found) {
  const ValidationMessage& message = messageOf(check);
  list_.push_back({check, message.severity, message.what, std::move(where), std::move(expected), std::move(found), 1});
}

std::vector<Finding> Findings::takeSorted() {
  std::stable_sort(list_.begin(), list_.end(), [](const Finding& a, const Finding& b) { return a.check < b.check; });
  return std::move(list_);
}

std::string toString(const Finding& f) {
  std::string text = (f.severity == FindingSeverity::error ? "E" : "W") + std::to_string(static_cast<int>(f.check));
  text += " " + f.what + ": " + f.where + ": expected " + f.expected + ", found " + f.found;
  if (f.count > 1) text += " (" + std::to_string(f.count) + " times)";
  return text;
}

std::vector<Finding> validateBake(const Bake& bake) {
  Findings findings;
  checkStructureInto(bake, findings, std::pmr::new_delete_resource());
  if (!findings.empty()) return findings.takeSorted();
  checkNumbers(bake, findings);
  checkSurfels(bake, findings);
  checkHierarchy(bake, findings);
  checkCaches(bake, findings);
  checkLinks(bake, findings);
  checkProvenance(bake, findings);
  checkCertificateValues(bake, findings);
  return findings.takeSorted();
}

Status checkStructure(const Bake& bake, std::pmr::memory_resource* memory) {
  Findings findings;
  checkStructureInto(bake, findings, memory);
  if (findings.empty()) return done();
  return Error{ErrorCode::invalidFile, toString(findings.list().front())};
}

Status checkBake(const Bake& bake, std::pmr::memory_resource* memory) {
  if (Status status = checkStructure(bake, memory); !status) return status;
  Findings findings;
  checkNumbers(bake, findings);
  if (findings.empty()) return done();
  return Error{ErrorCode::invalidFile, toString(findings.list().front())};
}

}  // namespace relume
