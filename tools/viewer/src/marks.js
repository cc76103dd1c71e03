// Points and distances on the screen, over the picture.

import { Vector3 } from 'three';

const SVG = 'http://www.w3.org/2000/svg';

function element( name, attributes ) {

	const made = document.createElementNS( SVG, name );
	for ( const [ key, value ] of Object.entries( attributes ) ) made.setAttribute( key, value );
	return made;

}

export class Marks {

	constructor() {

		this.overlay = document.getElementById( 'overlay' );
		this.labels = document.getElementById( 'labels' );
		this.points = [];
		this.texts = [];

	}

	/** Shows points, and between each two of them a line with a text, if there is one. */
	set( points, texts = [] ) {

		this.points = points;
		this.texts = texts;

	}

	draw( camera, width, height ) {

		this.overlay.replaceChildren();
		this.labels.replaceChildren();
		if ( this.points.length === 0 ) return;
		const at = new Vector3();
		const ahead = camera.getWorldDirection( new Vector3() );
		const places = this.points.map( point => {

			const seen = camera.isOrthographicCamera || at.copy( point ).sub( camera.position ).dot( ahead ) > camera.near;
			at.copy( point ).project( camera );
			return seen && { x: ( at.x + 1 ) / 2 * width, y: ( 1 - at.y ) / 2 * height };

		} );
		for ( const className of [ 'under', '' ] ) for ( let n = 1; n < places.length; n ++ ) {

			const [ a, b ] = [ places[ n - 1 ], places[ n ] ];
			if ( a && b ) this.overlay.append( element( 'line', { x1: a.x, y1: a.y, x2: b.x, y2: b.y, class: className } ) );

		}

		for ( const place of places ) if ( place ) this.overlay.append( element( 'circle', { cx: place.x, cy: place.y, r: 4.5 } ) );
		this.texts.forEach( ( text, n ) => {

			const [ a, b ] = [ places[ n ], places[ n + 1 ] ];
			if ( ! text || ! a || ! b ) return;
			const label = document.createElement( 'div' );
			label.className = 'label';
			label.textContent = text;
			Object.assign( label.style, { left: `${ ( a.x + b.x ) / 2 }px`, top: `${ ( a.y + b.y ) / 2 }px` } );
			this.labels.append( label );

		} );

	}

}

const AXES = [ [ 'x', '#d8433b' ], [ 'y', '#3f9b46' ], [ 'z', '#2f74d0' ] ];

/** The directions of the axes, in a corner. */
export function drawAxes( canvas, navigator ) {

	const context = canvas.getContext( '2d' ), middle = canvas.width / 2, length = middle * 0.56;
	const [ right, up, ahead ] = [ navigator.right(), navigator.up(), navigator.direction() ];
	context.clearRect( 0, 0, canvas.width, canvas.height );
	context.font = `600 ${ canvas.width * 0.14 }px system-ui, "DejaVu Sans", sans-serif`;
	context.textAlign = 'center';
	context.textBaseline = 'middle';
	const axes = AXES.map( ( [ name, color ] ) => ( { name, color, x: right[ name ], y: - up[ name ], depth: ahead[ name ] } ) );
	for ( const { name, color, x, y } of axes.sort( ( a, b ) => b.depth - a.depth ) ) {

		context.strokeStyle = context.fillStyle = color;
		context.lineWidth = canvas.width / 36;
		context.beginPath();
		context.moveTo( middle, middle );
		context.lineTo( middle + x * length, middle + y * length );
		context.stroke();
		context.fillText( name.toUpperCase(), middle + x * length * 1.38, middle + y * length * 1.38 );

	}

}

/** A length of the form 1, 2 or 5 times a power of ten that is at most `most`. */
export function roundLength( most ) {

	const power = 10 ** Math.floor( Math.log10( most ) );
	return [ 5, 2, 1 ].find( n => n * power <= most ) * power;

}
