#include "traceur/coach/why.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "traceur/core/text.h"

namespace traceur::coach {
namespace {

/// Where the body was when the best trial ended.
class BestTrial {
 public:
  explicit BestTrial(const PhaseLesson& p) : p_(p) {}

  std::optional<double> measure(std::string_view name) const {
    const auto found = std::ranges::find(p_.measures, name, &practice::Quantity::name);
    if (found == p_.measures.end() || !std::isfinite(found->value)) return {};
    return found->value;
  }
  double leaning() const { return measure("why_trunk").value_or(0) * 180 / std::numbers::pi; }
  /// Of the COM ahead of the feet [m].
  double lead() const { return measure("why_lead").value_or(0); }
  std::string trunk() const {
    return fmt::format("the trunk leaning {:.0f} deg {}", std::abs(leaning()),
                       leaning() < 0 ? "backward" : "forward");
  }
  std::string com() const {
    return fmt::format("the COM {:.2f} m {} the feet", std::abs(lead()),
                       lead() < 0 ? "behind" : "ahead of");
  }
  /// What touches that should not.
  std::string touching() const {
    std::vector<std::string> parts;
    for (const practice::Quantity& q : p_.measures) {
      if (q.name.starts_with("why_on_") && q.value > 0) parts.push_back(q.name.substr(7));
    }
    return parts.empty() ? "something but what may" : join(parts, " and ");
  }

 private:
  const PhaseLesson& p_;
};

std::string whatHappened(const PhaseLesson& p, const BestTrial& e) {
  const std::string when = fmt::format("{:.2f} s into {}", p.time, p.phase);
  if (p.ended == "touches") {
    return fmt::format("{} touch{} {}, {}", e.touching(), e.touching().ends_with("s") ? "" : "es",
                       when, e.trunk());
  }
  if (p.ended == "hops") return fmt::format("a foot comes off or slides {}, {}", when, e.com());
  if (p.ended == "falls_backward") return fmt::format("it falls backward {}, {}", when, e.com());
  if (p.ended == "falls_forward") return fmt::format("it falls forward {}, {}", when, e.com());
  if (p.ended == "late")
    return fmt::format("{} never ends: after {:.1f} s, {}", p.phase, p.time, e.com());
  int relations = 0;
  for (const Reading& r : p.readings) {
    // The compiler counts them in this order.
    if (!r.constraint.empty() && p.ended == fmt::format("not_{}", ++relations)) {
      const auto by = e.measure("by_" + p.ended);
      return fmt::format("\"{}\" does not hold at the end{}", r.means,
                         by ? fmt::format(": missed by {:.2g}", *by) : "");
    }
  }
  return fmt::format("{} ended with \"{}\" {}", p.phase, p.ended, when);
}

std::string howOften(const PhaseLesson& p) {
  int failed = 0;
  std::vector<std::string> ways;
  for (const auto& [name, count] : p.failures) {
    failed += count;
    if (count > 0) ways.push_back(fmt::format("{} {}", count, name));
  }
  return fmt::format("{} of {} trials failed: {}", failed, p.trials, join(ways));
}

/// What helps against an ending: tried in this order of what was seen.
std::pair<std::string, std::string> advice(const PhaseLesson& p, const BestTrial& e,
                                           std::string_view before) {
  const std::string earlier(before.empty() ? std::string_view(p.phase) : before);
  if (p.ended == "falls_backward") return {p.phase, "MOVE forward BY 0.1 m"};
  if (p.ended == "falls_forward") return {p.phase, "MOVE backward BY 0.1 m"};
  if (p.ended == "late") {
    if (p.phase == "leaning") return {p.phase, "MOVE forward BY 0.1 m"};
    return {p.phase == "thrusting" ? p.phase : earlier, "SPEEDUP 130%"};
  }
  if (p.ended == "touches") {
    if (e.leaning() > 60) return {earlier, "head ABOVE root"};
    return {p.phase, "MOVE upward BY 0.1 m"};
  }
  if (p.ended == "hops") {
    // The feet came down too far behind the COM, or too far ahead.
    return {earlier,
            e.lead() > 0 ? "TRANSLATE feet forward BY 0.1 m" : "TRANSLATE feet backward BY 0.1 m"};
  }
  return {p.phase, ""};
}

}  // namespace

Why why(const PhaseLesson& p, std::string_view before) {
  const BestTrial e(p);
  auto [phase, say] = advice(p, e, before);
  return {whatHappened(p, e), howOften(p), std::move(phase), std::move(say)};
}

}  // namespace traceur::coach
