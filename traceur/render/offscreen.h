// Pictures of a world with no display: MuJoCo's renderer on a software OpenGL context.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "traceur/render/camera.h"
#include "traceur/render/image.h"
#include "traceur/sim/model.h"
#include "traceur/sim/recording.h"

namespace traceur::render {

/// What is drawn over the picture.
struct DrawOptions {
  /// An arrow for the force on each robot body that touches something: from the middle of its
  /// contacts, a force of the robot's weight kArrowPerWeight of its size long, at most kArrowMost.
  bool contact_forces = false;
  bool com = false;  ///< a mark at the robot's centre of mass, seen through the body
};

inline constexpr double kArrowPerWeight = 0.5;  ///< [ours]
inline constexpr double kArrowMost = 0.8;       ///< in robot sizes [ours]

enum class Quality {
  kFast,  ///< one drawing with smooth edges, for video
  kFine   ///< the mean of several with the light and the pixel raster moved: soft shadows too
};

struct OffscreenOptions {
  int width = 320;   ///< [px], 16 to 8192
  int height = 240;  ///< [px], 16 to 8192
  Quality quality = Quality::kFine;
};

/// Draws one model's frames. All calls from one thread at a time.
class Offscreen {
 public:
  /// @throws InputError for a size out of range; SystemError when there is no off-screen context
  explicit Offscreen(std::shared_ptr<const sim::Model> model, const OffscreenOptions& options = {});
  ~Offscreen();
  Offscreen(const Offscreen&) = delete;
  Offscreen& operator=(const Offscreen&) = delete;

  /// @throws InputError when the frame is not of this model or holds NaN
  Image draw(const sim::Frame& frame, const Camera& camera = {}, const DrawOptions& options = {});

  /// One camera for each frame of a motion, with look_at and distance filled in: all equally far,
  /// moving smoothly or not at all (Camera::follow).
  /// @throws InputError as draw
  std::vector<Camera> aim(std::span<const sim::Frame> motion, const Camera& camera);

  /// The longest side of the box around the robot at joint angles 0 [m].
  double robotSize() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace traceur::render
