// An optimiser's state as bytes: exact, checked, and refused when it is not what it should be.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/optim/optimizer.h"

namespace traceur::optim {

/// Layout, little-endian: "TRCROPT\n", kind, version, then what the optimiser writes, in order,
/// without names; last a 64-bit fingerprint of all before it. Doubles keep every bit.
class StateWriter {
 public:
  /// @param kind     the optimiser: "cma-es"
  /// @param version  of the optimiser's layout; raise it with every change
  StateWriter(std::string_view kind, std::uint64_t version);

  void integer(std::uint64_t value);
  void real(double value);
  void reals(std::span<const double> values);  ///< count, then values
  void text(std::string_view value);           ///< count, then bytes

  /// The bytes, ending with the fingerprint. The writer is empty afterwards.
  std::string finish();

 private:
  std::string bytes_;
};

/// Reads back what a StateWriter wrote, in the same order. Every method throws InputError when the
/// bytes are foreign, damaged, too short, too long, of another kind or of another version.
class StateReader {
 public:
  StateReader(std::string_view bytes, std::string_view kind, std::uint64_t version);

  std::uint64_t integer();
  double real();
  std::vector<double> reals();
  /// Fills values; the stored count must be values.size().
  void reals(std::span<double> values);
  std::string text();
  /// Call last: nothing may be left.
  void finish() const;

 private:
  std::string_view take(std::uint64_t count);
  void copy(std::span<double> values);
  [[noreturn]] void fail(std::string_view why) const;

  std::string_view rest_;
  std::string kind_;
};

/// The numbers of a vector or matrix, in storage order.
std::span<const double> numbers(const auto& m) {
  return {m.data(), static_cast<size_t>(m.size())};
}
std::span<double> numbers(auto& m) {
  return {m.data(), static_cast<size_t>(m.size())};
}

void writeStop(StateWriter& writer, const std::optional<Stop>& stop);
std::optional<Stop> readStop(StateReader& reader);

}  // namespace traceur::optim
