// Runs before the program of the page, in any browser, also from a file.

// The embedding page may send messages as soon as this page has loaded; guest.js reads them later.
window.jointplayMail = [];
if (window !== window.top) {
    addEventListener('message', function (event) {
        window.jointplayMail.push(event);
    });
}

// Explains that the program could not be loaded.
function showStuck() {
    // A page opened as a file has no origin either, but is not framed.
    var sealed = window !== window.top && window.origin === 'null';
    document.getElementById(sealed ? 'sealed' : 'stuck').hidden = false;
}

// The error event of a script does not bubble; it is visible only in the capture phase.
addEventListener('error', function (event) {
    if (event.target.id === 'program') showStuck();
}, true);

// A browser without modules skips the program silently.
if (!('noModule' in HTMLScriptElement.prototype)) addEventListener('load', showStuck);
