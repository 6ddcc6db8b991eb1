# What Debian wants of packages besides what is installed elsewhere; cpack runs it on the files before it packs them.
cmake_policy(VERSION 3.25)
set(source ${CPACK_WELLSPACE_SOURCE_DIR})
set(stage ${CPACK_TEMPORARY_INSTALL_DIRECTORY})
set(packages runtime wellspace server wellspaced development libwellspace-dev core_development libwellspace-core-dev
    python python3-wellspace documentation wellspace-doc)

# run(COMMAND…) runs it, or ends.
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# The release in Debian's form, of CHANGELOG.md.
string(REPLACE . [.] version ${CPACK_PACKAGE_VERSION})
file(STRINGS ${source}/CHANGELOG.md release REGEX "^## .${version}. - ")
string(REGEX REPLACE ".* - " "" day "${release}")
execute_process(COMMAND date --utc --rfc-email --date=${day} OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE
                COMMAND_ERROR_IS_FATAL ANY)
set(debian_version ${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})
file(WRITE ${stage}/changelog.Debian
     "wellspace (${debian_version}) bookworm; urgency=medium\n\n  * The release ${CPACK_PACKAGE_VERSION}.\n\n"
     " -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")

# What the core alone wants has a package of its own, which the other one for development depends on.
set(from ${stage}/development/usr)
file(GLOB_RECURSE moved RELATIVE ${from} ${from}/lib/*/libwellspace_core*.a ${from}/include/wellspace/core/*
     ${from}/lib/*/wellspace-core*.cmake ${from}/lib/*/wellspace-config*.cmake ${from}/lib/*/wellspace-core.pc)
foreach(path IN LISTS moved)
  cmake_path(GET path PARENT_PATH folder)
  file(MAKE_DIRECTORY ${stage}/core_development/usr/${folder})
  file(RENAME ${from}/${path} ${stage}/core_development/usr/${path})
endforeach()
file(REMOVE_RECURSE ${from}/include/wellspace/core)

# Copyright, changelog and overrides of lintian.
while(packages)
  list(POP_FRONT packages component package)
  set(doc_dir ${stage}/${component}/usr/share/doc/${package})
  file(MAKE_DIRECTORY ${doc_dir})
  file(COPY_FILE ${source}/deploy/debian/copyright ${doc_dir}/copyright)
  file(COPY_FILE ${stage}/changelog.Debian ${doc_dir}/changelog.Debian)
  file(COPY_FILE ${source}/CHANGELOG.md ${doc_dir}/changelog)
  run(gzip -9n ${doc_dir}/changelog.Debian ${doc_dir}/changelog)
  file(MAKE_DIRECTORY ${stage}/${component}/usr/share/lintian/overrides)
  file(COPY_FILE ${source}/deploy/debian/lintian-overrides
       ${stage}/${component}/usr/share/lintian/overrides/${package})
endwhile()
file(REMOVE ${stage}/changelog.Debian)

# Licences of what is compiled in; those of shared libraries are in their own packages.
foreach(documents server/usr/share/doc/wellspaced development/usr/share/doc/libwellspace-dev
        core_development/usr/share/doc/libwellspace-core-dev runtime/usr/share/doc/wellspace)
  file(COPY ${source}/THIRD_PARTY.md DESTINATION ${stage}/${documents})
  run(${source}/scripts/third_party --build ${CPACK_WELLSPACE_BINARY_DIR} --copy ${stage}/${documents}/third_party)
  run(gzip -9nr ${stage}/${documents}/third_party)
endforeach()
file(COPY ${source}/README.md DESTINATION ${stage}/runtime/usr/share/doc/wellspace)
# Debian's zsh looks for completions of packages here.
file(MAKE_DIRECTORY ${stage}/runtime/usr/share/zsh)
file(RENAME ${stage}/runtime/usr/share/zsh/site-functions ${stage}/runtime/usr/share/zsh/vendor-completions)

file(MAKE_DIRECTORY ${stage}/server/etc/default)
file(COPY_FILE ${source}/deploy/debian/wellspaced/default ${stage}/server/etc/default/wellspaced)
# Debian 12 has the units of packages there.
file(MAKE_DIRECTORY ${stage}/server/lib)
file(RENAME ${stage}/server/usr/lib/systemd ${stage}/server/lib/systemd)
file(REMOVE_RECURSE ${stage}/server/usr/lib)

file(GLOB_RECURSE manuals ${stage}/*/usr/share/man/*)
run(gzip -9n ${manuals})
file(GLOB_RECURSE archives ${stage}/development/*.a ${stage}/core_development/*.a)
run(strip --strip-debug --remove-section=.comment --enable-deterministic-archives ${archives})
run(chmod -R u=rwX,go=rX ${stage})
