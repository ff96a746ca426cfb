// A place for the files of one test.
#pragma once

#include "traceur/core/temporary_folder.h"

namespace traceur {

using TestFolder = TemporaryFolder;

}  // namespace traceur
