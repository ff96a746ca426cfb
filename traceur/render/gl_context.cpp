#include "traceur/render/gl_context.h"

#include <GL/osmesa.h>

#include "traceur/core/error.h"
#include "traceur/core/sanitized.h"

// What sanitizer builds overlook: Mesa keeps a few hundred bytes of each context, and its drawing
// threads synchronise in ways the thread sanitizer does not see. Our own code stays checked.
// NOLINTBEGIN: the sanitizers' names
#ifdef TRACEUR_SANITIZE_ADDRESS
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libOSMesa.so\n";
}
#endif
#ifdef TRACEUR_SANITIZE_THREAD
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "race:libOSMesa.so\n";
}
#endif
// NOLINTEND

namespace traceur::render {
namespace {

constexpr int kWindow = 16;  // width and height of the default framebuffer [px]

}  // namespace

GlContext::GlContext() : window_(size_t{4} * kWindow * kWindow) {
  context_ = OSMesaCreateContextExt(OSMESA_RGBA, 24, 8, 8, nullptr);
  if (!context_) {
    throw SystemError(
        "cannot draw off-screen: OSMesa gives no OpenGL context (Debian: apt install libosmesa6)");
  }
  makeCurrent();
}

GlContext::~GlContext() {
  OSMesaMakeCurrent(nullptr, nullptr, OSMESA_RGBA, 0, 0);
  OSMesaDestroyContext(context_);
}

void GlContext::makeCurrent() {
  if (!OSMesaMakeCurrent(context_, window_.data(), GL_UNSIGNED_BYTE, kWindow, kWindow)) {
    throw SystemError("cannot draw off-screen: OSMesa does not make its context current");
  }
}

}  // namespace traceur::render
