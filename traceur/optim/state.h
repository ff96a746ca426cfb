// An optimiser's state as bytes: exact, checked, and refused when it is not what it should be.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/optim/optimizer.h"

namespace traceur::optim {

/// More than any run has, and so few that sums and products of numbers of trials cannot overflow.
inline constexpr std::uint64_t kMostGenerations = std::uint64_t{1} << 40;
inline constexpr std::uint64_t kMostTrials = std::uint64_t{1} << 60;
/// Likewise of what is counted in an int.
inline constexpr std::uint64_t kMostInARow = 1'000'000'000;

/// Writes a state. An optimiser names its fields once, in a function of either a StateWriter or a
/// StateReader:
///
///     template <class IO, class State>
///     void fields(IO& io, State& s) const {
///       io.integer(s.generation, 0, kMostGenerations);
///       io.finite(numbers(s.mean));
///     }
///
/// with State const when it is written. What is said of a field's range concerns only the reader.
///
/// Layout, little-endian: "TRCROPT\n", kind, version, then the fields in order, without names; last
/// a 64-bit fingerprint of all before it. Doubles keep every bit.
class StateWriter {
 public:
  static constexpr bool kReads = false;

  /// @param kind     the optimiser: "cma-es"
  /// @param version  of the optimiser's layout; raise it with every change
  StateWriter(std::string_view kind, std::uint64_t version);

  void integer(std::uint64_t value, std::uint64_t least = 0, std::uint64_t most = UINT64_MAX);
  void boolean(bool value) { integer(value); }
  void real(double value, double least = 0, double most = 0);
  void finite(double value) { real(value); }
  void positive(double value) { real(value); }
  void reals(std::span<const double> values);  ///< count, then values
  void finite(std::span<const double> values) { reals(values); }
  void positive(std::span<const double> values) { reals(values); }
  void text(std::string_view value);  ///< count, then bytes
  /// Whether there is one, and it.
  void optional(const auto& value, auto&& each) {
    integer(value.has_value());
    if (value) each(*value);
  }
  /// Count, and each.
  void list(const auto& values, std::uint64_t, std::uint64_t, auto&& each) {
    integer(values.size());
    for (const auto& value : values) each(value);
  }
  void list(const auto& values, auto&& each) { list(values, 0, 0, each); }
  void resize(const auto&, auto...) {}
  void require(bool, std::string_view) {}

  /// The bytes, ending with the fingerprint. The writer is empty afterwards.
  std::string finish();

 private:
  std::string bytes_;
};

/// Reads back what a StateWriter wrote, in the same order. Every method throws InputError when the
/// bytes are foreign, damaged, too short, too long, of another kind or of another version, or hold
/// a number out of its range. The fingerprint guards against accidents only: anyone can compute it,
/// so restore() believes no number that it has not read within a range, and no count that the bytes
/// left cannot fill.
class StateReader {
 public:
  static constexpr bool kReads = true;

  StateReader(std::string_view bytes, std::string_view kind, std::uint64_t version);

  std::uint64_t integer();
  /// In [least, most].
  template <std::integral Integer>
  void integer(Integer& value, std::uint64_t least, std::uint64_t most) {
    value = static_cast<Integer>(integerIn(least, most));
  }
  void boolean(bool& value) { integer(value, 0, 1); }
  void real(double& value);
  /// In [least, most], and so not NaN.
  void real(double& value, double least, double most);
  void finite(double& value);    ///< a finite number
  void positive(double& value);  ///< a finite number > 0
  void reals(std::vector<double>& values);
  /// Fills values; the stored count must be values.size().
  void reals(std::span<double> values);
  void finite(std::span<double> values);    ///< the same, all finite
  void positive(std::span<double> values);  ///< all finite and > 0
  void text(std::string& value);
  void optional(auto& value, auto&& each) {
    value.reset();
    if (integerIn(0, 1) != 0) each(value.emplace());
  }
  /// Of [least, most] things.
  void list(auto& values, std::uint64_t least, std::uint64_t most, auto&& each) {
    values.clear();
    for (std::uint64_t left = integerIn(least, most); left > 0; --left) {
      each(values.emplace_back());
    }
  }
  /// Of as many things as the bytes left can hold.
  void list(auto& values, auto&& each) {
    values.clear();
    for (std::uint64_t left = count(); left > 0; --left) each(values.emplace_back());
  }
  /// Makes room for what is read next.
  void resize(auto& values, auto... sizes) { values.resize(sizes...); }
  /// Refuses the state where it does not hold, for a reason of the caller's: "two states of one
  /// trial".
  void require(bool holds, std::string_view why) const {
    if (!holds) fail(why);
  }
  [[noreturn]] void fail(std::string_view why) const;
  /// Call last: nothing may be left.
  void finish() const;

 private:
  std::uint64_t integerIn(std::uint64_t least, std::uint64_t most);
  std::uint64_t count();
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

/// Why a search stopped, if it has.
void field(StateWriter& io, const std::optional<Stop>& stop);
void field(StateReader& io, std::optional<Stop>& stop);

}  // namespace traceur::optim
