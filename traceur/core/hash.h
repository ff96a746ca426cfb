// A fingerprint of numbers: equal runs have equal fingerprints.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace traceur {

/// FNV-1a over bytes, 64 bits: order matters, -0.0 and 0.0 differ, every NaN bit counts.
class Hash {
 public:
  void add(std::string_view bytes) {
    std::uint64_t value = value_;  // a register: bytes may alias a member
    for (const char c : bytes) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    value_ = value;
  }
  void add(std::span<const double> numbers) {
    add(std::string_view(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace traceur
