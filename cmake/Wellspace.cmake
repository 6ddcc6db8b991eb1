# Warnings, sanitizers and the shape of every target of the project.

add_library(wellspace_options INTERFACE)
# clang alone knows which lock guards what (GUARDED_BY).
target_compile_options(wellspace_options INTERFACE $<$<CXX_COMPILER_ID:Clang>:-Wthread-safety>
                       $<$<CXX_COMPILER_ID:Clang>:-Werror=thread-safety>)
target_compile_options(wellspace_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor)
target_include_directories(wellspace_options INTERFACE ${PROJECT_SOURCE_DIR})
option(WELLSPACE_WERROR "Treat warnings as errors; off in a subproject" ${PROJECT_IS_TOP_LEVEL})
# Not under sanitizers: their additions to the code make g++ see uninitialised values and wrong bounds that are none.
if(WELLSPACE_WERROR AND NOT WELLSPACE_SANITIZE)
  target_compile_options(wellspace_options INTERFACE -Werror)
endif()
if(WELLSPACE_SANITIZE)
  add_compile_options(-fsanitize=${WELLSPACE_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${WELLSPACE_SANITIZE})
  if(WELLSPACE_SANITIZE MATCHES "undefined")
    # These two triple the time of compilation, and find nothing here that a crash or AddressSanitizer would not.
    add_compile_options(-fno-sanitize=null,alignment)
  endif()
endif()
if(WELLSPACE_FUZZ)
  # Everything reports its coverage; only the fuzz targets link libFuzzer's main.
  add_compile_options(-fsanitize=fuzzer-no-link)
  add_link_options(-fsanitize=fuzzer-no-link)
endif()

# wellspace_together(TARGET [APART files…]) compiles files of the target several at a time, with WELLSPACE_TOGETHER: the
# headers of gRPC, CLI11 and abseil take most of the time of a build, and are read once for each lot. Files APART are
# compiled one by one. Names in unnamed namespaces must differ within a target.
function(wellspace_together target)
  cmake_parse_arguments(ARG "" "" "APART" ${ARGN})
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${WELLSPACE_TOGETHER} UNITY_BUILD_BATCH_SIZE 10)
  set_source_files_properties(${ARG_APART} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# wellspace_embed(NAME SYMBOL FILE) puts a file into wellspace_NAME, as the bytes from SYMBOL_begin to SYMBOL_end.
function(wellspace_embed name embedded_name embedded_file)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${embedded_name}.cc)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/embedded_file.cc.in ${source} @ONLY)
  set_source_files_properties(${source} PROPERTIES OBJECT_DEPENDS ${embedded_file} SKIP_UNITY_BUILD_INCLUSION ON)
  target_sources(wellspace_${name} PRIVATE ${source})
endfunction()

# wellspace_library(NAME SOURCES… [PUBLIC libs…] [PRIVATE libs…]) makes target wellspace_NAME with alias
# wellspace::NAME.
function(wellspace_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(wellspace_${name} STATIC ${ARG_SOURCES})
  add_library(wellspace::${name} ALIAS wellspace_${name})
  target_link_libraries(wellspace_${name} PUBLIC ${ARG_PUBLIC} PRIVATE $<BUILD_INTERFACE:wellspace_options> ${ARG_PRIVATE})
  target_include_directories(wellspace_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  target_compile_features(wellspace_${name} PUBLIC cxx_std_20)
endfunction()
