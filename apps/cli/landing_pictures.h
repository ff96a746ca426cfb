// The pictures of chapter 3 that no table stands behind.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace traceur::cli {

/// Touch-downs that ended well and badly over speed forward and down, and the planes that were
/// learned from them [Ha2015, Fig. 10, 11].
/// @param hands  that meet the ground first, instead of the feet
nlohmann::ordered_json drawLandingCondition(bool hands, std::uint64_t seed,
                                            const std::filesystem::path& file);
/// The poses to choose from in the air [Ha2015, Fig. 12].
nlohmann::ordered_json drawAirPoses(std::uint64_t seed, const std::filesystem::path& file);

}  // namespace traceur::cli
