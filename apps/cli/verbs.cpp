#include "apps/cli/verbs.h"

namespace traceur::cli {

const std::vector<AddVerb>& allVerbs() {
  static const std::vector<AddVerb> kVerbs = {
      addTry,  addLearn,   addCoach, addPerform, addExport,  addShow,     addRender,
      addPlot, addInspect, addLand,  addFall,    addBalance, addMinimise, addReproduce,
  };
  return kVerbs;
}

}  // namespace traceur::cli
