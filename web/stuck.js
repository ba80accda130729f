// Runs before the program of the page, in any browser, also from a file.

// The embedding page may send messages as soon as this page has loaded; guest.js reads them later.
window.jointplayMail = [];
if (window !== window.top) {
    addEventListener('message', function (event) {
        window.jointplayMail.push(event);
    });
}

// Whether the browser compiles a module of these bytes, which follow its header.
function compiles(bytes) {
    return typeof WebAssembly === 'object' && WebAssembly.validate(new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0].concat(bytes)));
}

// What the program needs of a browser beyond modules. The versions in index.html are the first ones that have all of it.
var needed = {
    'WebAssembly with SIMD': function () {
        return compiles([1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11]);
    },
    // A function that takes an `externref`.
    'WebAssembly with reference types': function () {
        return compiles([1, 5, 1, 96, 1, 111, 0]);
    },
    'WebAssembly.compileStreaming': function () {
        return typeof WebAssembly === 'object' && 'compileStreaming' in WebAssembly;
    },
    TransformStream: function () {
        return 'TransformStream' in window;
    },
    'Array.prototype.at': function () {
        return 'at' in Array.prototype;
    },
    'Object.hasOwn': function () {
        return 'hasOwn' in Object;
    },
    'String.prototype.replaceAll': function () {
        return 'replaceAll' in String.prototype;
    },
};
window.jointplayMissing = Object.keys(needed).filter(function (name) {
    return !needed[name]();
});

// Explains that the program could not be loaded.
function showStuck() {
    // A page opened as a file has no origin either, but is not framed.
    var sealed = window !== window.top && window.origin === 'null';
    var old = window.jointplayMissing.length > 0 || !('noModule' in HTMLScriptElement.prototype);
    document.getElementById('missing').textContent = window.jointplayMissing.join(', ') || 'modules';
    document.getElementById(sealed ? 'sealed' : old ? 'old' : 'stuck').hidden = false;
}

// The error event of a script does not bubble; it is visible only in the capture phase.
addEventListener('error', function (event) {
    if (event.target.id === 'program') showStuck();
}, true);

// A browser without modules skips the program silently, and one without its syntax stops at it.
addEventListener('load', function () {
    if (window.jointplayMissing.length > 0 || !('noModule' in HTMLScriptElement.prototype)) showStuck();
});
