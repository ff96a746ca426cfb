# LIBSVM: headers and one library, no package file of its own. Target SVM::SVM.
find_path(SVM_INCLUDE libsvm/svm.h)
find_library(SVM_LIBRARY svm)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(SVM REQUIRED_VARS SVM_LIBRARY SVM_INCLUDE)
if(SVM_FOUND AND NOT TARGET SVM::SVM)
  add_library(SVM::SVM UNKNOWN IMPORTED)
  set_target_properties(SVM::SVM PROPERTIES
    IMPORTED_LOCATION ${SVM_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${SVM_INCLUDE})
endif()
mark_as_advanced(SVM_INCLUDE SVM_LIBRARY)
