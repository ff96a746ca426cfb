// How the optimisers refuse what a caller gave them.
#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "traceur/core/error.h"

namespace traceur::optim {

/// @param who  begins the message: the optimiser's kind
/// @throws InputError always
template <typename... Args>
[[noreturn]] void refuse(std::string_view who, fmt::format_string<Args...> format, Args&&... args) {
  throw InputError(fmt::format("{}: {}", who, fmt::format(format, std::forward<Args>(args)...)));
}

}  // namespace traceur::optim
