#include "traceur/optim/state.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/core/hash.h"

namespace traceur::optim {
namespace {

static_assert(std::endian::native == std::endian::little, "states are stored little-endian");

constexpr std::string_view kMagic = "TRCROPT\n";
constexpr size_t kEndSize = sizeof(std::uint64_t);
/// The names of reasons to stop are shorter: "noeffectcoord".
constexpr size_t kLongestReason = 40;

std::uint64_t fingerprint(std::string_view bytes) {
  Hash hash;
  hash.add(bytes);
  return hash.value();
}

}  // namespace

StateWriter::StateWriter(std::string_view kind, std::uint64_t version) : bytes_(kMagic) {
  text(kind);
  integer(version);
}

void StateWriter::integer(std::uint64_t value, std::uint64_t /*least*/, std::uint64_t /*most*/) {
  bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void StateWriter::real(double value, double /*least*/, double /*most*/) {
  integer(std::bit_cast<std::uint64_t>(value));
}

void StateWriter::reals(std::span<const double> values) {
  integer(values.size());
  bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

void StateWriter::text(std::string_view value) {
  integer(value.size());
  bytes_.append(value);
}

std::string StateWriter::finish() {
  integer(fingerprint(bytes_));
  return std::move(bytes_);
}

StateReader::StateReader(std::string_view bytes, std::string_view kind, std::uint64_t version)
    : rest_(bytes), kind_(kind) {
  if (!bytes.starts_with(kMagic)) fail("these bytes are not an optimiser's state");
  if (bytes.size() < kMagic.size() + kEndSize) fail("the state is cut short");
  std::uint64_t stored = 0;
  std::memcpy(&stored, bytes.data() + bytes.size() - kEndSize, kEndSize);
  rest_.remove_suffix(kEndSize);
  if (stored != fingerprint(rest_)) fail("the state is damaged or cut short");
  rest_.remove_prefix(kMagic.size());
  std::string got_kind;
  text(got_kind);
  if (got_kind != kind) {
    fail(fmt::format("the state is one of \"{}\"", got_kind));
  }
  if (const std::uint64_t got = integer(); got != version) {
    fail(fmt::format("expected a state of version {}, got version {}", version, got));
  }
}

std::uint64_t StateReader::integer() {
  std::uint64_t value = 0;
  std::memcpy(&value, take(sizeof value).data(), sizeof value);
  return value;
}

std::uint64_t StateReader::integerIn(std::uint64_t least, std::uint64_t most) {
  const std::uint64_t value = integer();
  if (value < least || value > most) {
    fail(fmt::format("expected a number in [{}, {}], got {}", least, most, value));
  }
  return value;
}

std::uint64_t StateReader::count() {
  const std::uint64_t value = integer();
  if (value > rest_.size() / sizeof(std::uint64_t)) fail("the state is cut short");
  return value;
}

void StateReader::real(double& value) {
  value = std::bit_cast<double>(integer());
}

void StateReader::real(double& value, double least, double most) {
  real(value);
  if (!(least <= value && value <= most)) {
    fail(fmt::format("expected a number in [{}, {}], got {}", least, most, value));
  }
}

void StateReader::finite(double& value) {
  real(value, std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max());
}

void StateReader::positive(double& value) {
  real(value, std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max());
}

void StateReader::finite(std::span<double> values) {
  reals(values);
  for (const double value : values) {
    if (!std::isfinite(value)) fail(fmt::format("expected finite numbers, got {}", value));
  }
}

void StateReader::positive(std::span<double> values) {
  finite(values);
  for (const double value : values) {
    if (!(value > 0)) fail(fmt::format("expected numbers > 0, got {}", value));
  }
}

void StateReader::reals(std::vector<double>& values) {
  values.resize(count());
  copy(values);
}

void StateReader::reals(std::span<double> values) {
  if (const std::uint64_t count = integer(); count != values.size()) {
    fail(fmt::format("expected {} numbers, got {}", values.size(), count));
  }
  copy(values);
}

void StateReader::copy(std::span<double> values) {
  const std::string_view bytes = take(values.size_bytes());
  if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
}

void StateReader::text(std::string& value) {
  value = take(integer());
}

void StateReader::finish() const {
  if (!rest_.empty()) fail(fmt::format("{} bytes too many", rest_.size()));
}

std::string_view StateReader::take(std::uint64_t count) {
  if (count > rest_.size()) fail("the state is cut short");
  const std::string_view taken = rest_.substr(0, count);
  rest_.remove_prefix(count);
  return taken;
}

void StateReader::fail(std::string_view why) const {
  throw InputError(fmt::format("cannot restore {}: {}", kind_, why));
}

void field(StateWriter& io, const std::optional<Stop>& stop) {
  io.optional(stop, [&](const Stop& s) {
    io.text(s.reason);
    io.real(s.value);
    io.real(s.limit);
  });
}

void field(StateReader& io, std::optional<Stop>& stop) {
  io.optional(stop, [&](Stop& s) {
    io.text(s.reason);
    io.require(!s.reason.empty() && s.reason.size() <= kLongestReason &&
                   s.reason.find_first_not_of("abcdefghijklmnopqrstuvwxyz ") == std::string::npos,
               "its reason to stop is not a word");
    io.real(s.value);
    io.real(s.limit);
  });
}

}  // namespace traceur::optim
