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

/// More than any run has, and so few that sums and products of numbers of trials cannot overflow.
inline constexpr std::uint64_t kMostGenerations = std::uint64_t{1} << 40;
inline constexpr std::uint64_t kMostTrials = std::uint64_t{1} << 60;
/// Likewise of what is counted in an int.
inline constexpr std::uint64_t kMostInARow = 1'000'000'000;

/// Reads back what a StateWriter wrote, in the same order. Every method throws InputError when the
/// bytes are foreign, damaged, too short, too long, of another kind or of another version, or hold
/// a number out of its range. The fingerprint guards against accidents only: anyone can compute it,
/// so restore() believes no number that it has not read within a range, and no count that the bytes
/// left cannot fill.
class StateReader {
 public:
  StateReader(std::string_view bytes, std::string_view kind, std::uint64_t version);

  std::uint64_t integer();
  std::uint64_t integer(std::uint64_t least, std::uint64_t most);
  bool boolean();  ///< 0 or 1
  /// How many things follow, each of at least so many bytes.
  std::uint64_t count(std::uint64_t bytes_each);
  double real();
  /// In [least, most], and so not NaN.
  double real(double least, double most);
  double finite();    ///< a finite number
  double positive();  ///< a finite number > 0
  std::vector<double> reals();
  /// Fills values; the stored count must be values.size().
  void reals(std::span<double> values);
  void finite(std::span<double> values);    ///< the same, all finite
  void positive(std::span<double> values);  ///< all finite and > 0
  std::string text();
  /// Refuses the state for a reason of the caller's, as in "two states of one trial".
  [[noreturn]] void fail(std::string_view why) const;
  /// Call last: nothing may be left.
  void finish() const;

 private:
  std::string_view take(std::uint64_t count);
  void copy(std::span<double> values);

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
