# SPDX-License-Identifier: MIT
# The OpenCL implementations that the tests compare, for tests/stages.sh: Intel's CPU runtime from PyPI in a virtual environment
# under build/, Oclgrind from the system, and what the system has anyway. Nothing is installed outside build/; which of them a
# process sees is told by OCL_ICD_VENDORS. Intel's licence lets us test with it; the program neither needs nor ships it.

oclgrind=$(find /usr/lib /usr/local/lib -name liboclgrind-rt-icd.so -print -quit 2>/dev/null || true)

# Sets `reason` and fails if Intel's runtime can't be had. Done once: a later call finds it.
get_intel() {
    local venv=$here/venv
    reason=
    if [[ ! -e $here/.complete ]]; then
        printf 'installing intel-opencl-rt in %s (0.8 GB)\n' "$venv"
        rm -rf -- "$here"
        mkdir -p -- "$here"
        if ! python3 -m venv "$venv" >"$here/log" 2>&1; then
            reason='python3 -m venv fails'
        elif ! "$venv/bin/pip" install --disable-pip-version-check intel-opencl-rt intel-cmplr-lib-rt >>"$here/log" 2>&1; then
            reason='not to be had from PyPI'
        fi
        [[ -z $reason ]] || return 1
        touch "$here/.complete"
    fi
    [[ -e $venv/lib/libintelocl.so ]] || { reason='no libintelocl.so in its package'; return 1; }
    # It needs a newer libtbb than the system's, which the tests link; nothing else of the folder may shadow the system's.
    mkdir -p -- "$here/lib" "$here/intel"
    ln -sf -- "$venv/lib/libtbb.so.12" "$here/lib/"
    printf '%s\n' "$venv/lib/libintelocl.so" >"$here/intel/intel.icd"
}

on_intel() { env OCL_ICD_VENDORS="$here/intel" LD_LIBRARY_PATH="$here/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}" "$@"; }

# With every implementation there is: the system's own, Intel's, Oclgrind.
on_all() {
    rm -rf -- "$here/all"
    mkdir -p -- "$here/all"
    cp -- "${OCL_ICD_VENDORS:-/etc/OpenCL/vendors}"/*.icd "$here/all/" 2>/dev/null || true
    if [[ -z ${reason:-} ]]; then cp -- "$here/intel/intel.icd" "$here/all/"; fi
    [[ -z $oclgrind ]] || printf '%s\n' "$oclgrind" >"$here/all/oclgrind.icd"
    env OCL_ICD_VENDORS="$here/all" LD_LIBRARY_PATH="$here/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}" "$@"
}
