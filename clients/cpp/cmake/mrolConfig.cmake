# mrol::mrol is the shared library, mrol::static the static one with what it needs of the system.
get_filename_component(_mrol_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
find_package(Threads REQUIRED)
if(NOT TARGET mrol::mrol)
    add_library(mrol::mrol SHARED IMPORTED)
    set_target_properties(mrol::mrol PROPERTIES
        IMPORTED_LOCATION "${_mrol_prefix}/lib/libmrol_replica.so"
        IMPORTED_NO_SONAME ON
        INTERFACE_INCLUDE_DIRECTORIES "${_mrol_prefix}/include"
        INTERFACE_COMPILE_FEATURES cxx_std_17)
    add_library(mrol::static STATIC IMPORTED)
    set_target_properties(mrol::static PROPERTIES
        IMPORTED_LOCATION "${_mrol_prefix}/lib/libmrol_replica.a"
        INTERFACE_INCLUDE_DIRECTORIES "${_mrol_prefix}/include"
        INTERFACE_LINK_LIBRARIES "Threads::Threads;${CMAKE_DL_LIBS};m;rt"
        INTERFACE_COMPILE_FEATURES cxx_std_17)
endif()
unset(_mrol_prefix)
