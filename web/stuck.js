// What has to be there before the program of the page: the one script that any browser takes, from a file as well.

// A page around this one may speak as soon as this one has loaded, for which the browser waits for this script: what it says waits
// for guest.js.
window.jointplayMail = [];
if (window !== window.top) {
    addEventListener('message', function (event) {
        window.jointplayMail.push(event);
    });
}

// The program did not come: the page says so.
function stuck() {
    // A page that was opened as a file has no origin either.
    var sealed = window !== window.top && window.origin === 'null';
    document.getElementById(sealed ? 'sealed' : 'stuck').hidden = false;
}

// A script that cannot be loaded tells nobody but itself, and who listens on the way down to it.
addEventListener('error', function (event) {
    if (event.target.id === 'program') stuck();
}, true);

// Too old for modules: it leaves the program out and says nothing.
if (!('noModule' in HTMLScriptElement.prototype)) addEventListener('load', stuck);
