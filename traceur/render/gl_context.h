// The one place that knows how an off-screen OpenGL context is made.
#pragma once

#include <cstdint>
#include <vector>

struct osmesa_context;

namespace traceur::render {

/// A software context that needs neither display nor graphics card. One thread at a time.
class GlContext {
 public:
  /// @throws SystemError when the machine gives none
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// Directs this thread's OpenGL calls here.
  /// @throws SystemError
  void makeCurrent();

 private:
  osmesa_context* context_ = nullptr;
  std::vector<std::uint8_t> window_;  // the unused default framebuffer; drawing goes to another
};

}  // namespace traceur::render
