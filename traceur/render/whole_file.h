// Whether what another program wrote is all there: not each says so when the disk was full.
#pragma once

#include <filesystem>

namespace traceur::render {

/// Whether the file's parts (of a PNG its chunks, of an MP4 its boxes) follow each other to its
/// very end, and none that it needs is missing; of an SVG, whether its last element is closed.
/// Pictures and sound within the parts are not looked at. False for a file that cannot be read.
bool isWholePng(const std::filesystem::path& file);
bool isWholeSvg(const std::filesystem::path& file);
bool isWholeMp4(const std::filesystem::path& file);

}  // namespace traceur::render
