#include "traceur/control/virtual_force.h"

namespace traceur::control {

// By value is how Eigen hands out what may be written.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void VirtualForce::addTorque(const sim::Snapshot& s, Eigen::Ref<VectorXd> tau) const {
  if (at_com) {
    s.addComForce(f, tau);
  } else {
    s.addPointForce(body, p_BP, f, tau);
  }
  if (!moment.isZero(0)) s.addMoment(body, moment, tau);
}

std::vector<VirtualForce> reaction(const sim::Snapshot& s, const VirtualForce& force,
                                   const std::vector<sim::BodyId>& bodies) {
  std::vector<VirtualForce> out;
  const sim::Vector3d p = force.at_com ? s.com() : s.position({force.body, force.p_BP});
  const double share = 1.0 / static_cast<double>(bodies.size());
  for (const sim::BodyId body : bodies) {
    VirtualForce r;
    r.body = body;
    r.f = -share * force.f;
    r.moment = -share * ((p - s.bodyPosition(body)).cross(force.f) + force.moment);
    out.push_back(r);
  }
  return out;
}

}  // namespace traceur::control
